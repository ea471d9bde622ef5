// Organised clouds: each return in its row and column, NaN elsewhere.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <map>

#include "pointflight/lidar/lidar_settings.hpp"
#include "pointflight/ros/common/cloud_grid.hpp"
#include "pointflight/ros/common/cloud_points.hpp"
#include "pointflight/ros/common/point_layout.hpp"
#include "tests/ros_common/keeper.hpp"
#include "tests/sim/runs.hpp"

namespace pointflight {
namespace {

using testing::error_of;
using testing::expect_contains;
using testing::hall;
using testing::Keeper;

/// The clouds of 0.3 s of hovering with a LiDAR, as they are and organised.
struct Clouds {
  std::vector<msg::PointCloud2> plain, organized;
};

Clouds clouds_of(const std::string& lidar,
                 const std::string& layout,
                 const std::string& kind,
                 const std::vector<bool>& which = {false, true}) {
  Clouds clouds;
  for (const bool organized : which) {
    Scenario scenario = testing::hovering();
    scenario.duration = 0.3;
    scenario.vehicles[0].lidars = {LidarMount{}};
    scenario.vehicles[0].lidars[0].model = lidar;
    RosProfile profile = load_ros_profile("default");
    RosOutput output;
    output.kind = kind;
    output.topic = "/c";
    output.layout = layout;
    output.organized = organized;
    profile.outputs = {output};
    const Keeper keeper = testing::kept(scenario, hall(), profile);
    (organized ? clouds.organized : clouds.plain) = keeper.of<msg::PointCloud2>("/c");
  }
  return clouds;
}

/// Every return of the one is in the other at its ring's row, in the order of firing; else NaN.
void expect_same_returns(const Clouds& clouds, std::size_t rows) {
  ASSERT_FALSE(clouds.plain.empty());
  ASSERT_EQ(clouds.plain.size(), clouds.organized.size());
  for (std::size_t k = 0; k < clouds.plain.size(); ++k) {
    const msg::PointCloud2& organized = clouds.organized[k];
    ASSERT_EQ(organized.height, rows);
    EXPECT_EQ(organized.row_step, organized.width * organized.point_step);
    EXPECT_FALSE(organized.is_dense);
    const auto plain_points = points_of(clouds.plain[k]).points;
    const auto cells = points_of(organized).points;
    ASSERT_EQ(cells.size(), std::size_t{organized.width} * rows);
    std::map<std::int32_t, std::vector<RecordedPoint>> plain, ringwise;
    for (const RecordedPoint& p : plain_points) plain[p.ring].push_back(p);
    for (std::size_t i = 0; i < cells.size(); ++i) {
      EXPECT_EQ(cells[i].ring, cells[i - i % organized.width].ring);
      if (cells[i].position.allFinite()) ringwise[cells[i].ring].push_back(cells[i]);
    }
    ASSERT_EQ(plain.size(), ringwise.size());
    for (const auto& [ring, points] : plain) {
      ASSERT_EQ(points.size(), ringwise[ring].size()) << ring;
      for (std::size_t i = 0; i < points.size(); ++i) {
        EXPECT_EQ(points[i].position, ringwise[ring][i].position);
        EXPECT_EQ(points[i].intensity, ringwise[ring][i].intensity);
      }
    }
  }
}

TEST(OrganizedClouds, Slow_HaveARowForEachRing) {
  const Clouds vlp16 = clouds_of("vlp16", "velodyne", "cloud");
  expect_same_returns(vlp16, 16);
  EXPECT_NEAR(vlp16.organized[0].width, 1808, 2);  // firings in 0.1 s: one every 55.296 us
  const Clouds os1 = clouds_of("os1_32", "ouster", "cloud");
  expect_same_returns(os1, 32);
  EXPECT_EQ(os1.organized[0].width, 1024u);
  expect_same_returns(clouds_of("xt32", "hesai", "cloud"), 32);
  expect_same_returns(clouds_of("mid360", "livox", "cloud"), 4);
  // whose channels fire at times of their own, some beyond their cycle
  for (const auto& [lidar, rings] : std::map<std::string, std::size_t>{{"hdl32e", 32},
                                                                       {"hdl64e_s3", 64},
                                                                       {"vlp32c", 32},
                                                                       {"vls128", 128},
                                                                       {"pandar40p", 40},
                                                                       {"pandar64", 64},
                                                                       {"qt64", 64}}) {
    SCOPED_TRACE(lidar);
    expect_same_returns(clouds_of(lidar, "xyzit", "cloud"), rings);
  }
}

TEST(OrganizedClouds, OfCamerasAreTheirPixels) {
  const Clouds clouds = clouds_of("marsim_grid", "xyzi", "cloud_world");
  ASSERT_FALSE(clouds.organized.empty());
  const LidarSettings lidar = load_lidar("marsim_grid");
  EXPECT_EQ(clouds.organized[0].height, static_cast<std::uint32_t>(lidar.grid.rows));
  EXPECT_EQ(clouds.organized[0].width, static_cast<std::uint32_t>(lidar.grid.columns));
  std::size_t finite = 0;
  double top = 0.0, bottom = 0.0;
  const auto cells = points_of(clouds.organized[0]).points;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    if (!cells[i].position.allFinite()) continue;
    ++finite;
    (i < cells.size() / 2 ? top : bottom) += cells[i].position.z();
  }
  EXPECT_EQ(finite, clouds.plain[0].width);
  EXPECT_GT(top, bottom);
}

TEST(OrganizedClouds, TimesOfCellsWithoutAReturnAreThoseOfTheirFiring) {
  const Clouds clouds = clouds_of("vlp16", "xyzit", "cloud");
  const auto cells = points_of(clouds.organized.at(1)).points;
  const std::size_t width = clouds.organized[1].width;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const double firing = 0.1 * static_cast<double>(i % width) / static_cast<double>(width);
    EXPECT_NEAR(cells[i].time, firing, 2e-4);
  }
}

TEST(OrganizedClouds, AreRefusedWhereThereAreNoRows) {
  expect_contains(error_of([] { clouds_of("mid360", kLivoxCustom, "cloud", {true}); }),
                  "/c: Livox' own message has no rows");
  expect_contains(error_of([] { clouds_of("mid360", kLivoxCustom, "cloud_world", {false}); }),
                  "/c: Livox' own message is of the sensor's frame");
  // fires ring 0 twice
  const testing::TemporaryFolder folder;
  testing::write_file(folder / "t.csv",
                      "ring,elevation_deg,azimuth_offset_deg\n0,0,0\n0,1,0\n1,2,0\n");
  LidarSettings odd = load_lidar("vlp16");
  odd.rings.table = folder / "t.csv";
  expect_contains(error_of([&] { CloudGrid{odd}; }), "its rings do not fire in turn");
}

}  // namespace
}  // namespace pointflight
