#include "pointflight/survey/sensor_fit.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "pointflight/core/constants.hpp"
#include "pointflight/core/random.hpp"
#include "pointflight/geometry/rotation.hpp"
#include "pointflight/io/csv_table.hpp"
#include "pointflight/lidar/lidar.hpp"
#include "tests/support.hpp"

namespace pointflight {
namespace {

/// A hall of 30 x 16 x 7 m with a few boxes, whose map has no more errors than surfels need.
std::shared_ptr<const SurfelMap> room() {
  static const auto map = [] {
    ShapeScene scene;
    scene.add_box({-10, -6, -2}, {20, 10, 5});
    scene.add_box({4, 2, -2}, {6, 4, 0.5});
    scene.add_box({-5, -4, -2}, {-3, -2.5, 1});
    return testing::map_of(scene, 0.1);
  }();
  return map;
}

/// Scans of a sensor that stands in it, as a recording has them.
std::vector<RecordedScan> recorded(const LidarSettings& settings, std::size_t count) {
  const Lidar lidar(settings, 0, nullptr, Surroundings{});
  const auto renderer = make_renderer("beam", Scene{room()});
  const PoseTrack still(Pose{quaternion_from_rpy(0.02, -0.03, 0.4), {1.0, 0.5, 0.3}});
  std::vector<RecordedScan> scans(count);
  for (std::size_t i = 0; i < count; ++i) {
    ScanRequest request;
    request.index = i;
    request.start = SimTime(static_cast<std::int64_t>(i) * lidar.period());
    const Scan scan = lidar.take(request, still, *renderer, Executor(2));
    scans[i].time = 1.7e9 + to_seconds(scan.start);
    for (const ScanPoint& p : scan.points) {
      scans[i].points.push_back(
          {p.position_sensor.cast<double>(), 0.0f, to_seconds(p.time_offset), p.ring});
    }
  }
  return scans;
}

TEST(SensorFit, Statistics_FindsTheNoiseThatASensorWasGiven) {
  struct Case {
    const char* model;
    double range_sigma, angle_sigma_deg;
  };
  for (const Case& c :
       {Case{"mid360", 0.02, 0.075}, {"avia", 0.01, 0.02}, {"os1_128", 0.03, 0.1}}) {
    LidarSettings settings = load_lidar(c.model);
    settings.noise = {};
    settings.noise.range_sigma = c.range_sigma;
    settings.noise.range_step = 0.002;
    settings.optics.angle_sigma_deg = c.angle_sigma_deg;
    settings.optics.sub_rays = 1;
    settings.detection.false_alarm = 0.0;
    const SensorFit fit = fit_sensor(recorded(settings, c.model[0] == 'o' ? 4 : 20), Executor(2));
    EXPECT_NEAR(fit.noise.range.sigma, c.range_sigma, 0.04 * c.range_sigma) << c.model;
    EXPECT_NEAR(fit.noise.angle.sigma / kDegree, c.angle_sigma_deg, 0.1 * c.angle_sigma_deg)
        << c.model;
    // an Ouster's ranges are whole steps from where its beams begin, beside the origin
    EXPECT_EQ(fit.range_step, c.model[0] == 'o' ? 0.0 : 0.002) << c.model;
    EXPECT_GT(2 * fit.on_patches, fit.points) << c.model;
    EXPECT_EQ(fit.turn.has_value(), c.model[0] == 'o') << c.model;
    ASSERT_TRUE(fit.rate);
    EXPECT_NEAR(*fit.rate, settings.rate, 1e-3 * settings.rate);
    EXPECT_NEAR(fit.unrest, 1.0, 0.1) << c.model;
    // each bin by itself: what the two figures give at its ranges and incidences
    EXPECT_GE(fit.bins.size(), 3u);
    for (const NoiseBin& bin : fit.bins) {
      if (bin.patches < 20) continue;
      const double expected = std::hypot(c.range_sigma, c.angle_sigma_deg * kDegree * bin.tangent);
      EXPECT_NEAR(bin.sigma, expected, 0.15 * expected)
          << c.model << " at " << bin.range << " m, " << bin.incidence_from / kDegree << " deg";
    }
  }
}

TEST(SensorFit, Statistics_WhatWeakSignalsJitterShowsWithItsError) {
  LidarSettings settings = load_lidar("os0_32");
  settings.optics.sub_rays = 1;
  settings.optics.angle_sigma_deg = 0.0;
  settings.detection.false_alarm = 0.0;
  settings.noise = {};
  settings.noise.range_sigma = 0.005;
  for (const double at_limit : {0.0, 0.03, 0.06}) {
    settings.noise.range_sigma_at_limit = at_limit;
    const std::vector<RecordedScan> scans = recorded(settings, 10);
    const SensorFit fit = fit_sensor(scans, Executor(2), {}, settings.detection);
    EXPECT_NEAR(fit.noise.range.sigma, 0.005, 0.0015) << at_limit;
    EXPECT_NEAR(fit.noise.at_limit.sigma, at_limit, 0.2 * at_limit + 0.003) << at_limit;
    EXPECT_EQ(fit.noise.at_limit.shows(), at_limit > 0.0);
    EXPECT_LT(fit.noise.at_limit.error, 0.004);
    LidarSettings like = settings;
    like.noise.range_sigma_at_limit = 0.05;  // of its sheet
    EXPECT_NEAR(with_fit(like, fit, "").noise.range_sigma_at_limit, fit.noise.at_limit.sigma, 1e-4);
  }
  // nothing was near its limit: what the sheet says stays
  settings.detection.rated = {{0.1, 200.0, 100.0}};
  const SensorFit strong = fit_sensor(recorded(settings, 4), Executor(2), {}, settings.detection);
  EXPECT_FALSE(strong.noise.at_limit.shows());
  settings.noise.range_sigma_at_limit = 0.05;
  EXPECT_EQ(with_fit(settings, strong, "").noise.range_sigma_at_limit, 0.05);
}

TEST(NoiseFit, FindsPartsByTheirShapeAndSaysHowWell) {
  const RandomStream random(9, StreamId::kTest, 0);
  std::vector<NoiseSample> samples;
  constexpr double kPoints = 60.0;
  for (std::uint64_t i = 0; i < 400; ++i) {
    const auto [u, v] = random.uniform2(2 * i);
    NoiseSample sample{0.0, 20.0 * u * u, v * v * v, kPoints};
    const double truth = 1e-4 + sample.lever * sample.lever * 1e-6 + sample.weakness * 9e-4;
    // a chi square of many degrees is about normal
    sample.variance = truth * (1.0 + std::sqrt(2.0 / (kPoints - 3.0)) * random.normal(2 * i + 1));
    samples.push_back(sample);
  }
  const NoiseFit fit = fit_noise(samples, 2.5);
  EXPECT_NEAR(fit.range.sigma, 0.01, 3.0 * fit.range.error);
  EXPECT_NEAR(fit.angle.sigma, 0.001, 3.0 * fit.angle.error);
  EXPECT_NEAR(fit.at_limit.sigma, 0.03, 3.0 * fit.at_limit.error);
  EXPECT_LT(fit.range.error, 0.0005);
  EXPECT_LT(fit.at_limit.error, 0.001);
  EXPECT_TRUE(fit.at_limit.shows());
  for (NoiseSample& sample : samples) sample.weakness = 0.0;
  const NoiseFit blind = fit_noise(samples, 10.0);
  EXPECT_FALSE(blind.at_limit.shows());
  EXPECT_EQ(blind.at_limit.sigma, 0.0);
}

TEST(SensorFit, Slow_FindsTheRingsOfASpinningSensor) {
  for (const char* model : {"vlp16", "vlp32c"}) {
    LidarSettings settings = load_lidar(model);
    settings.optics.sub_rays = 1;
    settings.noise.ring_offset_sigma = 0.0;  // what is drawn is found as well
    const SensorFit fit = fit_sensor(recorded(settings, 6), Executor(2));
    ASSERT_TRUE(fit.turn) << model;
    EXPECT_NEAR(fit.turn->rate, 10.0, 0.002);
    EXPECT_TRUE(fit.turn->is_clockwise);
    EXPECT_NEAR(fit.turn->cycle_us, settings.rings.cycle_us, 0.005);
    const CsvTable table(tables_of(settings).at(0)->c_str());
    ASSERT_EQ(fit.turn->rings.size(), table.rows());
    double first_azimuth = 0.0;
    for (std::size_t row = 0; row < table.rows(); ++row) {
      if (table.at(row, table.require("ring")) == 0.0) {
        first_azimuth = table.at(row, table.require("azimuth_offset_deg"));
      }
    }
    for (std::size_t row = 0; row < table.rows(); ++row) {
      const auto number = static_cast<std::size_t>(table.at(row, table.require("ring")));
      const RingFit& ring = fit.turn->rings[number];
      EXPECT_EQ(ring.ring, static_cast<std::int32_t>(number));
      EXPECT_NEAR(ring.elevation_deg, table.at(row, table.require("elevation_deg")), 0.02) << model;
      EXPECT_NEAR(ring.azimuth_offset_deg,
                  table.at(row, table.require("azimuth_offset_deg")) - first_azimuth,
                  0.03)
          << model << " ring " << number;
      EXPECT_NEAR(ring.fire_time_us, table.at(row, table.require("fire_time_us")), 0.05) << model;
      EXPECT_NEAR(ring.range_offset, 0.0, 0.003);
    }
  }
}

TEST(SensorFit, Statistics_ARingsOwnRangeOffsetShows) {
  LidarSettings settings = load_lidar("vlp16");
  settings.optics.sub_rays = 1;
  settings.noise.ring_offset_sigma = 0.0;
  std::vector<RecordedScan> scans = recorded(settings, 4);
  for (RecordedScan& scan : scans) {
    for (RecordedPoint& p : scan.points) {
      if (p.ring == 7) p.position += 0.02 * p.position.normalized();
    }
  }
  const SensorFit fit = fit_sensor(scans, Executor(2));
  ASSERT_TRUE(fit.turn);
  // planes are fitted to all rings of a patch, so that part of it goes to the others
  EXPECT_GT(fit.turn->rings[7].range_offset, 0.006);
  for (const RingFit& ring : fit.turn->rings) {
    if (ring.ring != 7) {
      EXPECT_LT(std::abs(ring.range_offset), 0.008);
    }
  }
}

TEST(SensorFit, Slow_SaysWhenTheSensorMovedAndWhenNothingIsFlat) {
  const LidarSettings settings = load_lidar("mid360");
  std::vector<RecordedScan> scans = recorded(settings, 10);
  for (std::size_t i = 0; i < scans.size(); ++i) {
    for (RecordedPoint& p : scans[i].points) {
      p.position += static_cast<double>(i) * Vector3d(0.012, 0.009, 0.006);
    }
  }
  EXPECT_GT(fit_sensor(scans, Executor(2)).unrest, 1.8);
  std::vector<RecordedScan> foliage(1);
  const RandomStream random(1, StreamId::kTest, 9);
  for (std::uint64_t i = 0; i < 20000; ++i) {
    const auto [u, v] = random.normal2(i);
    foliage[0].points.push_back({{static_cast<float>(u),
                                  static_cast<float>(v),
                                  static_cast<float>(random.normal(i + 30000))}});
  }
  testing::expect_contains(
      testing::error_of([&] { static_cast<void>(fit_sensor(foliage, Executor(2))); }),
      "flat patches");
}

TEST(SensorFit, Statistics_ItsFileIsASensorThatMeasuresAsTheOneRecorded) {
  LidarSettings settings = load_lidar("vlp16");
  settings.optics.sub_rays = 1;
  settings.rate = 5.0;
  const SensorFit fit = fit_sensor(recorded(settings, 4), Executor(2));
  const testing::TemporaryFolder folder;
  LidarSettings made = with_fit(load_lidar("vlp16"), fit, "mine_rings.csv");
  testing::write_file(folder / "mine_rings.csv", rings_csv(*fit.turn));
  SettingsWriter writer;
  describe(writer, made);
  testing::write_file(folder / "mine.yaml", writer.text());
  const LidarSettings read = load_lidar(folder / "mine.yaml");
  EXPECT_EQ(read.rate, 5.0);
  const auto own = ScanBeams(settings).of(0, Executor(1));
  const auto fitted = ScanBeams(read).of(0, Executor(1));
  ASSERT_NEAR(
      static_cast<double>(fitted->beams.size()), static_cast<double>(own->beams.size()), 32.0);
  // beams of one number and one time look the same way: to a few hundredths of a degree
  double worst = 0.0;
  for (std::size_t i = 0; i + 64 < own->beams.size(); ++i) {
    const Beam& a = own->beams[i];
    const Beam& b = fitted->beams[i];
    ASSERT_EQ(a.ring, b.ring);
    // where the head stands at time zero is nobody's to know
    const double elevation = std::asin(a.direction_sensor.z()) - std::asin(b.direction_sensor.z());
    worst = std::max(worst, std::abs(elevation));
  }
  EXPECT_LT(worst / kDegree, 0.03);
}

}  // namespace
}  // namespace pointflight
