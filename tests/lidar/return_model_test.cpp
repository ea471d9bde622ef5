#include "pointflight/lidar/return_model.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "pointflight/core/constants.hpp"
#include "pointflight/core/math.hpp"
#include "pointflight/core/random.hpp"
#include "pointflight/core/resources.hpp"
#include "pointflight/lidar/lidar.hpp"
#include "pointflight/render/internal/beam_kernel.hpp"
#include "tests/lidar/one_beam.hpp"
#include "tests/support.hpp"

namespace pointflight {
namespace {

/// Surfaces of this reflectivity in full sun and clear air.
Surroundings reflecting(double reflectivity) {
  Surroundings where;
  where.reflectivity = reflectivity;
  return where;
}

using testing::map_of;

Hit hit_at(double range, double incidence_deg) {
  Hit hit;
  hit.range = static_cast<float>(range);
  hit.cos_incidence = static_cast<float>(std::cos(incidence_deg * kDegree));
  return hit;
}

using testing::BeamChance;
using testing::measured;

BeamChance chance_of(std::uint64_t i) {
  const RandomStream random(3, StreamId::kTest, 0);
  const auto [detection, place] = random.uniform2(2 * i);
  return {random.normal(2 * i + 1), detection, place};
}

std::vector<BeamChance> chances_from(std::uint64_t first, std::size_t count) {
  std::vector<BeamChance> all;
  for (std::uint64_t i = 0; i < count; ++i) all.push_back(chance_of(first + i));
  return all;
}

/// Greatest distance between the distribution of `samples` and the standard normal's, times the
/// square root of their number: above 1.95 once in a thousand times (Kolmogorov, Smirnov).
double ks_statistic(std::vector<double> samples) {
  std::sort(samples.begin(), samples.end());
  const auto n = static_cast<double>(samples.size());
  double worst = 0.0;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const double expected = 0.5 * std::erfc(-samples[i] / std::sqrt(2.0));
    worst = std::max({worst,
                      std::abs(expected - static_cast<double>(i) / n),
                      std::abs(expected - static_cast<double>(i + 1) / n)});
  }
  return worst * std::sqrt(n);
}

TEST(ReturnModel, RangeNoiseIsAsTheFormulaSaysAtFiveRangesAndFourIncidences) {
  LidarSettings os1 = load_lidar("os1_32");
  os1.noise.range_step = 0.0;  // the distribution, before it is rounded
  const Surroundings where = reflecting(0.8);
  const ReturnModel model(os1, where);
  constexpr std::uint64_t kBeams = 50000;
  std::uint64_t draw = 0;
  for (const double range : {2.0, 20.0, 50.0, 75.0, 90.0}) {
    for (const double incidence : {0.0, 30.0, 50.0, 60.0}) {
      const Hit hit = hit_at(range, incidence);
      // written out: the sheet's power law, amplitude over noise
      const double gamma = std::log(100.0 / 45.0) / std::log(8.0);
      const double margin =
          8.0 * static_cast<double>(hit.cos_incidence) * std::pow(45.0 / range, 1.0 / gamma);
      const double sigma = std::hypot(0.01, 0.06 / margin);
      EXPECT_NEAR(model.range_sigma(range, margin), sigma, 1e-12);
      std::vector<double> samples;
      const auto chances = chances_from(std::exchange(draw, draw + kBeams), kBeams);
      for (const Return& made : measured(model, hit, chances)) {
        if (made.range < 0.0f || made.label == kFalseReturn) continue;
        samples.push_back((static_cast<double>(made.range) - range) / sigma);
      }
      if (samples.size() < 1000) continue;  // hardly anything comes back from there
      EXPECT_LT(ks_statistic(samples), 2.2) << range << " m, " << incidence << " deg";
    }
  }
}

TEST(ReturnModel, AsManyComeBackAsTheProbabilitySays) {
  const LidarSettings os1 = load_lidar("os1_32");
  const ReturnModel model(os1, reflecting(0.1));
  const DetectionModel detection(os1.detection, 100.0);
  constexpr std::uint64_t kBeams = 200000;
  for (const double range : {40.0, 45.0, 50.0, 60.0}) {
    const Hit hit = hit_at(range, 0.0);
    std::uint64_t back = 0;
    for (const Return& made : measured(model, hit, chances_from(0, kBeams))) {
      back += made.range >= 0.0f ? 1 : 0;
    }
    const double expected = detection.probability(detection.margin(0.1, range));
    const double sigma = std::sqrt(expected * (1.0 - expected) / kBeams);
    EXPECT_NEAR(static_cast<double>(back) / kBeams, expected, 4.0 * sigma + 1e-12) << range;
  }
}

TEST(ReturnModel, SureEchoesAreNotMarginalAndMostOthersAre) {
  const RandomStream random(5, StreamId::kTest, 0);
  for (const std::string name : {"os1_128", "vlp32c", "mid360", "avia"}) {
    for (const double fog : {0.0, 100.0}) {
      Surroundings where = reflecting(0.2);
      if (fog > 0.0) where.weather = {.kind = WeatherKind::kFog, .visibility = fog};
      const ReturnModel model(load_lidar(name), where);
      const SureEchoes sure = model.sure_echoes();
      ASSERT_FALSE(sure.reflectivities.empty()) << name;
      std::size_t close = 0;  // to the border, where energies a third lower may be missed
      for (std::uint64_t i = 0; i < 2000; ++i) {
        const auto [range, times] = random.uniform2(i);
        Echo echo;
        echo.range = static_cast<float>(1.0 + (model.reach() - 1.0) * range);
        const auto step = static_cast<std::size_t>(echo.range * sure.steps_per_m);
        const float border = sure.reflectivities[std::min(step, sure.reflectivities.size() - 1)];
        if (!std::isfinite(border)) continue;
        echo.reflectivity = border * static_cast<float>(1.0 + times);
        EXPECT_FALSE(model.is_marginal(echo, 0.75, 1.25)) << name << " " << echo.range;
        echo.reflectivity = border * 0.75f;
        close += model.is_marginal(echo, 0.75, 1.25) ? 1 : 0;
      }
      EXPECT_GT(close, 1000u) << name << ": the border is much too high";
    }
  }
}

TEST(ReturnModel, EmptyBeamsReportFalseRangesAnywhere) {
  const ReturnModel model(load_lidar("mid360"), Surroundings{});
  std::vector<double> ranges;
  constexpr std::uint64_t kBeams = 1000000;
  for (const Return& made : measured(model, Hit{}, chances_from(0, kBeams))) {
    if (made.range < 0.0f) continue;
    EXPECT_EQ(made.label, kFalseReturn);
    ranges.push_back(static_cast<double>(made.range));
  }
  EXPECT_NEAR(static_cast<double>(ranges.size()), 100.0, 40.0);  // 1e-4 of a million, four sigma
  double mean = 0.0;
  for (const double range : ranges) mean += range / static_cast<double>(ranges.size());
  EXPECT_NEAR(mean / model.reach(), 0.5, 0.12);
}

TEST(ReturnModel, RangesAreWholeSteps) {
  const LidarSettings vlp = load_lidar("vlp32c");
  const ReturnModel model(vlp, Surroundings{});
  for (std::uint64_t i = 0; i < 100; ++i) {
    const double steps =
        static_cast<double>(measured(model, hit_at(17.3, 0.0), chance_of(i)).range) / 0.004;
    EXPECT_NEAR(steps, std::round(steps), 1e-3);
  }
}

/// A return by the formulas of the public functions, one by one.
float range_by_formula(const ReturnModel& model,
                       const LidarSettings& lidar,
                       const DetectionModel& detection,
                       const Hit& hit,
                       const BeamChance& chance) {
  const auto range = static_cast<double>(hit.range);
  const double margin = detection.margin(
      static_cast<double>(static_cast<float>(model.reflectivity(hit))), std::max(range, 0.01));
  if (chance.detection >= detection.probability(margin)) return -1.0f;
  double made = range + model.range_sigma(range, margin) * chance.normal;
  const double step = lidar.noise.range_step;
  if (step > 0.0) made = step * std::floor(made / step + 0.5);
  const auto rounded = static_cast<float>(made);
  return static_cast<double>(rounded) < lidar.range_min ? -1.0f : rounded;
}

TEST(ReturnModel, ManyBeamsAreTheBitsOfTheFormulasWithEveryInstructionSet) {
  const std::size_t beams = testing::repeats(std::size_t{10001});
  const RandomStream random(8, StreamId::kTest, 0);
  std::vector<Hit> hits(beams);
  std::vector<double> normal(beams), detected(beams), place(beams, 0.5);
  random.uniform2(1u << 20u, detected, place);
  std::vector<double> unused(beams);
  random.normal2(1u << 21u, normal, unused);
  for (std::size_t i = 0; i < beams; ++i) {
    const auto [near, cosine] = random.uniform2(i);
    if (i % 7 == 3) continue;  // hits nothing
    // from 1 mm to 300 m, by decades
    hits[i].range = static_cast<float>(0.001 * std::pow(3e5, near));
    hits[i].cos_incidence = static_cast<float>(cosine);
    hits[i].surfel = static_cast<std::uint32_t>(i);
  }
  std::size_t back = 0;
  for (const std::string& name : model_names("lidars")) {
    const LidarSettings lidar = load_lidar(name);
    if (lidar.detection.rated.empty()) continue;
    const ReturnModel model(lidar, Surroundings{});
    const DetectionModel detection(lidar.detection, Surroundings{}.sun_klx);
    for (const std::string& kernel : kernel_names()) {
      use_kernel(kernel);
      const std::size_t most = most_returns(lidar.detection.returns);
      std::vector<Return> made(beams * most);
      model.measure(hits, {normal, detected, place, {}}, made);
      for (std::size_t i = 0; i < beams; ++i) {
        const Return& one = made[i * most];
        if (detected[i] < lidar.detection.false_alarm) {
          EXPECT_EQ(one.label, kFalseReturn);
          continue;
        }
        const float expected =
            hits[i].is_return()
                ? range_by_formula(model, lidar, detection, hits[i], {normal[i], detected[i]})
                : -1.0f;
        ASSERT_EQ(one.range, expected) << name << ' ' << kernel << ' ' << i;
        back += one.is_return() ? 1 : 0;
      }
    }
  }
  use_kernel("");
  EXPECT_GT(back, beams);
}

TEST(ReturnModel, ReportsTheIntensityInTheSensorsUnit) {
  Surroundings where = reflecting(0.4);
  const Hit slanted = hit_at(10.0, 60.0);
  EXPECT_NEAR(measured(ReturnModel(load_lidar("mid360"), where), slanted, {0, 0.5, 0}).intensity,
              150.0 * 0.4 * 0.5,
              1e-3);
  where.reflectivity_per_intensity = 0.01;
  Hit bright = hit_at(10.0, 0.0);
  bright.intensity = 90.0f;
  EXPECT_NEAR(measured(ReturnModel(load_lidar("os1_32"), where), bright, {0, 0.5, 0}).intensity,
              90.0,
              1e-3);
  bright.intensity = 1e6f;  // a reflector
  EXPECT_EQ(measured(ReturnModel(load_lidar("os1_32"), where), bright, {0, 0.5, 0}).intensity,
            255.0f);
}

/// Share of a Mid-360's beams that meet a wall across its axis and come back from it.
double share_back(double distance, double reflectivity, std::uint64_t seed = 1) {
  constexpr float kHalf = 8.0f;  // m: beams that meet it nearly face on
  ShapeScene scene;
  scene.add_box({distance, -30, -30}, {distance + 1, 30, 30});
  const auto map = map_of(scene, 0.5);
  const auto renderer = make_renderer("beam", Scene{map});
  const Lidar lidar(load_lidar("mid360"), 0, nullptr, reflecting(reflectivity));
  const Executor executor(2);
  ScanRequest request;
  request.seed = seed;
  const Scan scan = lidar.take(request, PoseTrack(), *renderer, executor);
  std::size_t there = 0;
  std::size_t aimed = 0;
  for (const Beam& beam : lidar.beams(0, executor)) {
    const Vector3f d = beam.direction_sensor;
    aimed += d.x() > 0.1f && std::abs(d.y() / d.x()) * static_cast<float>(distance) < kHalf &&
                     d.z() / d.x() * static_cast<float>(distance) < kHalf
                 ? 1
                 : 0;
  }
  for (const ScanPoint& point : scan.points) {
    if (point.label == kFalseReturn) continue;
    const Vector3f& p = point.position_sensor;
    there += std::abs(p.y()) < kHalf && p.z() < kHalf ? 1 : 0;
  }
  return static_cast<double>(there) / static_cast<double>(aimed);
}

TEST(Lidar, Statistics_SeesAWhiteWallFromFartherThanADarkOne) {
  EXPECT_GT(share_back(30.0, 0.8), 0.99);
  EXPECT_GT(share_back(60.0, 0.8), 0.6);
  EXPECT_GT(share_back(20.0, 0.1), 0.95);
  EXPECT_LT(share_back(50.0, 0.05), 0.02);
}

TEST(Lidar, Statistics_DirectionsHaveTheFilesNoiseAndPointsDoNotSayIt) {
  ShapeScene scene;
  scene.add_box({10, -12, -12}, {11, 12, 12});
  const auto map = map_of(scene, 0.1);
  const auto renderer = make_renderer("beam", Scene{map});
  LidarSettings settings = load_lidar("mid360");
  settings.noise = {};
  settings.optics.angle_sigma_deg = 0.5;
  const Lidar lidar(settings, 0, nullptr, reflecting(0.8));
  const Executor executor(2);
  const Scan scan = lidar.take({}, PoseTrack(), *renderer, executor);
  const std::vector<Beam> beams = lidar.beams(lidar.pattern_scan(0, 0), executor);
  double squares = 0.0;
  double count = 0.0;
  for (const ScanPoint& point : scan.points) {
    if (point.label == kFalseReturn) continue;
    const Vector3f nominal = beams[point.beam].direction_sensor;
    EXPECT_LT((point.position_sensor / point.range - nominal).norm(), 1e-5f);
    if (std::abs(nominal.y()) > 0.5f || nominal.x() < 0.5f || nominal.z() < 0.2f) continue;
    // a wall at x = 10: range 10 / cos(angle), so d(range) = 10 tan(angle) / cos(angle) d(angle)
    const double cosine = static_cast<double>(nominal.x());
    const double slope = 10.0 * std::sqrt(1.0 - cosine * cosine) / (cosine * cosine);
    const double off = (static_cast<double>(point.range) - 10.0 / cosine) / slope;
    squares += off * off;
    count += 1.0;
  }
  ASSERT_GT(count, 500.0);
  EXPECT_NEAR(std::sqrt(squares / count) / kDegree, 0.5, 0.05);
}

TEST(Lidar, ModelledReturnsDoNotDependOnThreads) {
  ShapeScene scene;
  scene.add_box({-30, -30, -2}, {30, 30, 10});
  const auto map = map_of(scene, 0.3);
  const auto renderer = make_renderer("beam", Scene{map});
  const Lidar lidar(load_lidar("mid360"), 0, nullptr, Surroundings{});
  const Scan one = lidar.take({}, PoseTrack(), *renderer, Executor(1));
  const Scan two = lidar.take({}, PoseTrack(), *renderer, Executor(2));
  ASSERT_EQ(one.points.size(), two.points.size());
  for (std::size_t i = 0; i < one.points.size(); ++i) {
    ASSERT_EQ(one.points[i].range, two.points[i].range);
    ASSERT_EQ(one.points[i].intensity, two.points[i].intensity);
  }
}

}  // namespace
}  // namespace pointflight
