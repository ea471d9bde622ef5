#include "pointflight/learn/range_pattern.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

#include "pointflight/learn/flights.hpp"
#include "tests/map/edited_map.hpp"
#include "tests/support.hpp"

namespace pointflight {
namespace {

using testing::map_of;

/// A wall at x = 8 m.
std::shared_ptr<const SurfelMap> wall() {
  static const auto map = [] {
    ShapeScene scene;
    scene.add_rectangle({8, -6, -6}, {0, 12, 0}, {0, 0, 12});
    return map_of(scene, 0.1);
  }();
  return map;
}

/// 400 beams that hit it within 4 m of x.
std::vector<Vector3f> ahead() {
  std::vector<Vector3f> all;
  for (int i = 0; i < 20; ++i) {
    for (int k = 0; k < 20; ++k) {
      const Vector3f to(
          8.0f, -4.0f + 0.4f * static_cast<float>(i), -4.0f + 0.4f * static_cast<float>(k));
      all.push_back(to.normalized());
    }
  }
  return all;
}

std::shared_ptr<const ReturnModel> vlp16(double reflectivity) {
  Surroundings surroundings;
  surroundings.reflectivity = reflectivity;
  return std::make_shared<const ReturnModel>(load_lidar("vlp16"), surroundings);
}

/// A reflectivity of which a VLP-16 sees as much at 9 m as of what it is rated for.
double half_seen() {
  return DetectionModel(load_lidar("vlp16").detection, 100.0).rated_reflectivity(9.0);
}

/// Ranges of `count` vehicles at the origin, m; 12: nothing.
std::vector<float> seen(const RangePattern& pattern, std::size_t count, int threads = 1) {
  const auto renderer = make_renderer("beam", Scene{wall()});
  std::vector<std::uint32_t> all;
  for (std::uint32_t i = 0; i < count; ++i) all.push_back(i);
  std::vector<float> ranges(count * pattern.size());
  pattern.measure(*renderer,
                  std::vector<PosePair>(count),
                  all,
                  ranges,
                  Executor(threads),
                  nullptr,
                  [](std::uint32_t vehicle) {
                    return ScanAddress{3, 0, vehicle};
                  });
  for (float& range : ranges) range *= 12.0f;
  return ranges;
}

TEST(RangePattern, Statistics_BeamsComeBackAsOftenAsTheSensorsDo) {
  constexpr std::size_t kImages = 200;
  const DetectionModel detection(load_lidar("vlp16").detection, 100.0);
  const double dark = half_seen();
  const auto model = vlp16(dark);
  RangePattern pattern(ahead(), {}, 12.0f);
  const std::vector<float> exact = seen(pattern, 1);
  pattern.report_by(model);
  const std::vector<float> reported = seen(pattern, kImages);
  double expected = 0.0;
  double variance = 0.0;
  double back = 0.0;
  for (std::size_t k = 0; k < pattern.size(); ++k) {
    const auto range = static_cast<double>(exact[k]);
    const double cosine = static_cast<double>(ahead()[k].x());
    const double often = detection.probability(detection.margin(dark * cosine, range));
    expected += kImages * often;
    variance += kImages * often * (1.0 - often);
    for (std::size_t i = 0; i < kImages; ++i) {
      const float one = reported[i * pattern.size() + k];
      back += std::abs(one - exact[k]) < 0.3f ? 1.0 : 0.0;
    }
  }
  EXPECT_GT(expected, 0.1 * kImages * 400);
  EXPECT_LT(expected, 0.9 * kImages * 400);
  // incidences of the map's own normals and false alarms: half a per cent
  EXPECT_NEAR(back, expected, 4.0 * std::sqrt(variance) + 0.005 * kImages * 400);
}

TEST(RangePattern, Statistics_RangesHaveTheSensorsNoise) {
  constexpr std::size_t kImages = 50;
  const auto model = vlp16(0.5);
  RangePattern pattern(ahead(), {}, 12.0f);
  const std::vector<float> exact = seen(pattern, 1);
  pattern.report_by(model);
  const std::vector<float> reported = seen(pattern, kImages);
  double squares = 0.0;
  double expected = 0.0;
  double count = 0.0;
  for (std::size_t k = 0; k < reported.size(); ++k) {
    const float range = exact[k % pattern.size()];
    const double off = static_cast<double>(reported[k] - range);
    if (std::abs(off) > 0.3) continue;  // false alarms
    const double sigma = model->range_sigma(static_cast<double>(range), 1e6);
    squares += off * off;
    expected += sigma * sigma;
    count += 1.0;
  }
  EXPECT_GT(count, 0.99 * kImages * 400);
  EXPECT_NEAR(std::sqrt(squares / expected), 1.0, 0.05);
}

TEST(RangePattern, Threads_ReportsDependOnTheirAddressAlone) {
  RangePattern pattern(ahead(), {}, 12.0f, 4);
  pattern.report_by(vlp16(half_seen()));
  const std::vector<float> many = seen(pattern, 40, 2);
  const std::vector<float> few = seen(pattern, 3, 1);
  EXPECT_TRUE(std::equal(few.begin(), few.end(), many.begin()));
  EXPECT_FALSE(std::equal(few.begin(), few.begin() + 100, few.begin() + 100));
}

TEST(RangePattern, FlightsDrawAnewForEachActionAndEachSeed) {
  RangePattern pattern(ahead(), {}, 12.0f);
  pattern.report_by(vlp16(0.5));
  Flights flights(wall(), load_vehicle("quad_330"), 2, {}, pattern);
  const Executor executor(1);
  const std::vector<std::uint32_t> both{0, 1};
  const auto image = [&] {
    std::vector<float> ranges(2 * pattern.size());
    flights.measure(both, ranges, executor);
    return ranges;
  };
  FlightStart start;
  start.seed = 4;
  flights.place(0, start);
  flights.place(1, start);
  const auto first = image();
  EXPECT_EQ(first, image());
  EXPECT_TRUE(std::equal(first.begin(), first.begin() + 400, first.begin() + 400));
  start.seed = 5;
  flights.place(1, start);
  EXPECT_NE(first, image());
  start.seed = 4;
  flights.place(1, start);
  EXPECT_EQ(first, image());
  flights.step(std::vector<double>(8, 0.0), {}, executor);
  EXPECT_NE(first, image());
  std::vector<float> ranges(400);
  EXPECT_THROW(pattern.measure(*make_renderer("beam", Scene{wall()}),
                               std::vector<PosePair>(1),
                               std::vector<std::uint32_t>{0},
                               ranges,
                               executor),
               std::invalid_argument);
}

TEST(RangePattern, WhatLetsBeamsThroughDoesSoAnewForEachAction) {
  const auto net = testing::opened(testing::noted(*wall(), [](const Vector3d&) {
    SurfelNote note;
    note.opacity = Opacity::of_share(0.5);
    return note;
  }));
  Flights flights(net, load_vehicle("quad_330"), 2, {}, RangePattern(ahead(), {}, 12.0f));
  const Executor executor(1);
  const auto image = [&] {
    std::vector<float> ranges(800);
    flights.measure(std::vector<std::uint32_t>{0, 1}, ranges, executor);
    return ranges;
  };
  for (std::size_t i = 0; i < 2; ++i) {
    FlightStart start;
    start.seed = i;
    flights.place(i, start);
  }
  const auto first = image();
  const auto returned = std::count_if(first.begin(), first.end(), [](float r) { return r < 1.0f; });
  EXPECT_NEAR(static_cast<double>(returned), 400.0, 85.0);  // six standard deviations
  EXPECT_FALSE(std::equal(first.begin(), first.begin() + 400, first.begin() + 400));
  EXPECT_EQ(first, image());
  flights.step(std::vector<double>(8, 0.0), {}, executor);
  EXPECT_NE(first, image());
}

}  // namespace
}  // namespace pointflight
