// What is in a sensor's way: which directions, how much of the time, and what is no such file.
#include "pointflight/lidar/blockage.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "pointflight/core/constants.hpp"
#include "pointflight/lidar/lidar.hpp"
#include "tests/support.hpp"

namespace pointflight {
namespace {

using testing::error_of;
using testing::expect_contains;
using testing::TemporaryFolder;

Vector3f towards(double azimuth_deg, double elevation_deg) {
  const double a = azimuth_deg * kDegree;
  const double e = elevation_deg * kDegree;
  return Vector3d(std::cos(e) * std::cos(a), std::cos(e) * std::sin(a), std::sin(e)).cast<float>();
}

TEST(Blockage, SectorsReachAcrossTheBackAndTheGreatestShareCounts) {
  const Blockage blockage(std::vector<BlockedSector>{{150.0, -150.0, -40.0, 10.5, 1.0},
                                                     {-30.0, 30.0, -90.0, -60.0, 0.25},
                                                     {0.0, 10.0, -70.0, -65.0, 0.5}});
  EXPECT_EQ(blockage.share(towards(179.0, 0.0)), 1.0);
  EXPECT_EQ(blockage.share(towards(-151.0, -39.0)), 1.0);
  EXPECT_EQ(blockage.share(towards(149.0, 0.0)), 0.0);
  EXPECT_EQ(blockage.share(towards(170.0, 10.4)), 1.0);
  EXPECT_EQ(blockage.share(towards(170.0, 10.6)), 0.0);  // of the same band of elevation
  EXPECT_EQ(blockage.share(towards(20.0, -66.0)), 0.25);
  EXPECT_EQ(blockage.share(towards(5.0, -66.0)), 0.5);
  EXPECT_EQ(blockage.share(towards(0.0, -89.9)), 0.25);
  EXPECT_EQ(blockage.share(Vector3f::UnitZ()), 0.0);
  EXPECT_TRUE(Blockage().empty());
}

TEST(Blockage, TheLevelIsUniformAndMovesSmoothly) {
  constexpr int kSteps = 20000;
  std::vector<double> levels;
  double largest_step = 0.0;
  for (int i = 0; i < kSteps; ++i) {
    levels.push_back(blockage_level(7, 3, SimTime(std::chrono::milliseconds(100 * i))));
    if (i > 0) largest_step = std::max(largest_step, std::abs(levels[i] - levels[i - 1]));
  }
  EXPECT_LT(largest_step, 0.7);
  std::sort(levels.begin(), levels.end());
  for (const double p : {0.05, 0.25, 0.5, 0.75, 0.95}) {  // 2,000 independent draws
    EXPECT_NEAR(levels[static_cast<std::size_t>(p * kSteps)], p, 0.04) << p;
  }
  EXPECT_NE(blockage_level(7, 3, SimTime{}), blockage_level(7, 4, SimTime{}));
}

TEST(Blockage, TablesAreReadAndWritten) {
  const std::vector<BlockedSector> read = parse_blocked_sectors(
      "# legs\nazimuth_from_deg,azimuth_to_deg,elevation_from_deg,elevation_to_deg\n"
      "40,50,-60,-20\n-50,-40,-60,-20\n",
      "legs.csv");
  ASSERT_EQ(read.size(), 2u);
  EXPECT_EQ(read[1].azimuth_from, -50.0);
  EXPECT_EQ(read[1].share, 1.0);
  const std::vector<BlockedSector> sectors = {{170.0, -170.0, -5.5, 3.25, 0.35}};
  const auto again = parse_blocked_sectors(blocked_sectors_csv(sectors), "b.csv");
  ASSERT_EQ(again.size(), 1u);
  EXPECT_EQ(again[0].azimuth_to, -170.0);
  EXPECT_EQ(again[0].elevation_to, 3.25);
  EXPECT_EQ(again[0].share, 0.35);
  const std::string head =
      "azimuth_from_deg,azimuth_to_deg,elevation_from_deg,elevation_to_deg,share\n";
  const auto error = [&](const std::string& rows) {
    return error_of([&] { static_cast<void>(parse_blocked_sectors(rows, "b.csv")); });
  };
  expect_contains(error(head + "0,10,0,10,1.5\n"), "b.csv:2: share 1.5 is not between 0 and 1");
  expect_contains(error(head + "0,190,0,10,1\n"), "b.csv:2: azimuth_to_deg 190");
  expect_contains(error(head + "0,10,0,,1\n"), "b.csv:2: elevation_to_deg");
  expect_contains(error(head + "0,10,20,10,1\n"), "elevation_from_deg 20 is not below");
  expect_contains(error("azimuth_from_deg\n0\n"), "azimuth_to_deg");
}

/// A sensor in a closed box, and how many of its points lie in a cone about a direction.
std::size_t seen_about(const Lidar& lidar, const ScanRequest& request, const Vector3f& direction) {
  static const auto renderer = [] {
    ShapeScene scene;
    scene.add_box({-6, -5, -4}, {6, 5, 4});
    return make_renderer("beam", Scene{testing::map_of(scene, 0.1)});
  }();
  const Scan scan = lidar.take(request, PoseTrack(), *renderer, Executor(2));
  return static_cast<std::size_t>(
      std::count_if(scan.points.begin(), scan.points.end(), [&](const ScanPoint& point) {
        return point.position_sensor.normalized().dot(direction) > 0.996f;
      }));
}

TEST(Lidar, Slow_WhatIsBlockedBringsNothingBackForItsShareOfTheTime) {
  const TemporaryFolder folder;
  testing::write_file(folder / "mine_blocked.csv",
                      "azimuth_from_deg,azimuth_to_deg,elevation_from_deg,elevation_to_deg,share\n"
                      "60,120,-30,30,1\n-120,-60,-30,30,0.3\n");
  LidarSettings settings = load_lidar("os0_32");
  settings.blocked = "mine_blocked.csv";
  settings.path = folder / "mine.yaml";
  const Surroundings where{.reflectivity = 0.5};
  const Lidar free(load_lidar("os0_32"), 0, nullptr, where);
  const Lidar carried(settings, 0, nullptr, where);
  const Lidar ideal(settings, 0);  // without modelled returns
  const Vector3f left = Vector3f::UnitY();
  const Vector3f right = -Vector3f::UnitY();
  EXPECT_GT(seen_about(free, {}, left), 50u);
  EXPECT_EQ(seen_about(carried, {}, left), 0u);
  EXPECT_EQ(seen_about(ideal, {}, left), 0u);
  EXPECT_EQ(seen_about(carried, {}, Vector3f::UnitX()), seen_about(free, {}, Vector3f::UnitX()));
  int blocked = 0;
  constexpr int kScans = 300;
  for (int i = 0; i < kScans; ++i) {
    ScanRequest request;
    request.start = SimTime(std::chrono::seconds(i));
    const std::size_t seen = seen_about(ideal, request, right);
    EXPECT_TRUE(seen == 0 || seen > 50) << seen;  // comes and goes as one
    blocked += seen == 0 ? 1 : 0;
  }
  EXPECT_NEAR(static_cast<double>(blocked) / kScans, 0.3, 0.09);
  settings.blocked = "none.csv";
  expect_contains(error_of([&] { const Lidar lidar(settings, 0); }), "none.csv");
}

}  // namespace
}  // namespace pointflight
