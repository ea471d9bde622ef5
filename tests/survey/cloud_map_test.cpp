#include "pointflight/survey/cloud_map.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "pointflight/core/random.hpp"
#include "pointflight/io/pcd_writer.hpp"
#include "pointflight/survey/left_out_points.hpp"
#include "tests/support.hpp"

namespace pointflight {
namespace {

using testing::TemporaryFolder;

constexpr double kLong = 10.0;  // m, along x
constexpr double kWide = 8.0;   // m, along y
constexpr double kHigh = 3.0;   // m
constexpr double kWall = 5.0;   // m: a wall across the room stands at this x, open beyond kDoor
constexpr double kDoor = 6.5;   // m, along y

/// Points `spacing` apart, each a fifth of that aside, on the inside of a room with a wall amid it
/// and on the top of its ceiling.
std::vector<Vector3d> divided_room(double spacing) {
  std::vector<Vector3d> points;
  const RandomStream random(1, StreamId::kTest, 0);
  const auto add = [&](const Vector3d& corner, const Vector3d& u, const Vector3d& v) {
    const int rows = static_cast<int>(u.norm() / spacing);
    const int columns = static_cast<int>(v.norm() / spacing);
    for (int i = 0; i < rows; ++i) {
      for (int k = 0; k < columns; ++k) {
        const auto [a, b] = random.uniform2(points.size());
        points.push_back(corner + (i + 0.3 + 0.4 * a) / rows * u +
                         (k + 0.3 + 0.4 * b) / columns * v);
      }
    }
  };
  const Vector3d x(kLong, 0, 0);
  const Vector3d y(0, kWide, 0);
  const Vector3d z(0, 0, kHigh);
  add({0, 0, 0}, x, y);
  add({0, 0, kHigh}, x, y);
  add({0, 0, kHigh + 0.3}, x, y);
  add({0, 0, 0}, x, z);
  add({0, kWide, 0}, x, z);
  add({0, 0, 0}, y, z);
  add({kLong, 0, 0}, y, z);
  add({kWall, 0, 0}, {0, kDoor, 0}, z);
  return points;
}

std::vector<Vector3f> single(const std::vector<Vector3d>& points) {
  std::vector<Vector3f> result;
  for (const Vector3d& point : points) result.push_back(point.cast<float>());
  return result;
}

std::string saved(const std::string& path, const std::vector<Vector3d>& points) {
  std::vector<CloudPoint> cloud;
  for (const Vector3d& point : points) cloud.push_back({.position = point});
  write_cloud_pcd(OutputFile(path), cloud, false);
  return path;
}

TEST(LeftOutPoints, AreSeenFromWithinARoomAndNotThroughItsWalls) {
  const Vector3d origin(100.0, 0.0, 0.0);
  const auto rays = rays_to_left_out(single(divided_room(0.04)), origin, 0.035, Executor(2));
  ASSERT_GT(rays.size(), 10000u);
  int through = 0;
  for (const LeftOutRay& one : rays) {
    const Vector3d from = one.ray.origin_world - origin;
    const Vector3d direction = one.ray.direction_world.cast<double>();
    const Vector3d to = from + static_cast<double>(one.range) * direction;
    // not from the top of the ceiling, which sees nothing else
    EXPECT_LT(from.z(), kHigh);
    // the end lies on a surface
    const double off = std::min({std::abs(to.x()),
                                 std::abs(to.x() - kLong),
                                 std::abs(to.x() - kWall),
                                 std::abs(to.y()),
                                 std::abs(to.y() - kWide),
                                 std::abs(to.z()),
                                 std::abs(to.z() - kHigh),
                                 std::abs(to.z() - kHigh - 0.3)});
    EXPECT_LT(off, 0.05);
    if (to.z() > kHigh + 0.15) ++through;
    const double share = (kWall - from.x()) / (to.x() - from.x());
    if (share > 0.0 && share < 0.97 && from.y() + share * (to.y() - from.y()) < kDoor) ++through;
  }
  // one in a hundred slips through
  EXPECT_LT(through, static_cast<int>(rays.size() / 50));
}

TEST(LeftOutPoints, Threads_DoNotDependOnTheThreads) {
  const auto points = single(divided_room(0.05));
  const auto one = rays_to_left_out(points, Vector3d::Zero(), 0.04, Executor(1));
  const auto three = rays_to_left_out(points, Vector3d::Zero(), 0.04, Executor(3));
  ASSERT_GT(one.size(), 10000u);
  ASSERT_EQ(one.size(), three.size());
  for (std::size_t i = 0; i < one.size(); ++i) {
    EXPECT_EQ(one[i].ray.origin_world, three[i].ray.origin_world);
    EXPECT_EQ(one[i].ray.direction_world, three[i].ray.direction_world);
    EXPECT_EQ(one[i].range, three[i].range);
  }
}

TEST(LeftOutPoints, AreNoneWithoutGroundOrRoom) {
  EXPECT_TRUE(rays_to_left_out({}, Vector3d::Zero(), 0.1, Executor(1)).empty());
  std::vector<Vector3f> wall;  // upright
  const RandomStream random(1, StreamId::kTest, 0);
  for (std::uint64_t i = 0; i < 20000; ++i) {
    const auto [y, z] = random.uniform2(i);
    wall.emplace_back(0.0f, static_cast<float>(5.0 * y), static_cast<float>(5.0 * z));
  }
  EXPECT_TRUE(rays_to_left_out(wall, Vector3d::Zero(), 0.02, Executor(1)).empty());
}

TEST(CloudMap, TakesAResolutionThatItTried) {
  const TemporaryFolder folder;
  const CloudSource room(saved(folder / "room.pcd", divided_room(0.05)));
  const CloudMap made = map_clouds({room}, {}, Executor(2));
  ASSERT_GE(made.tried.size(), 3u);
  const double resolution = made.map.report.resolution;
  EXPECT_GE(resolution, 0.9 * made.tried.front().resolution);
  EXPECT_LE(resolution, made.tried.back().resolution);
  EXPECT_TRUE(made.map.report.resolution_was_tried);
  EXPECT_FALSE(made.map.report.resolution_was_chosen);
  for (const TriedResolution& one : made.tried) {
    EXPECT_GT(one.right, 0.5);
    EXPECT_GT(one.rays, 2000u);
  }
}

TEST(CloudMap, Slow_TriesPlacesOfALargeCloud) {
  const TemporaryFolder folder;
  std::vector<Vector3d> points = divided_room(0.06);
  const std::size_t one = points.size();
  for (int copy = 1; copy < 6; ++copy) {
    for (std::size_t i = 0; i < one; ++i) points.push_back(points[i] + Vector3d(40.0 * copy, 0, 0));
  }
  const CloudSource rooms(saved(folder / "rooms.pcd", points));
  const auto tried = try_resolutions({rooms}, {}, Executor(2), {}, 2 * one);
  ASSERT_GE(tried.size(), 3u);
  // as in one room by itself
  const CloudSource room(saved(folder / "room.pcd", {points.begin(), points.begin() + one}));
  EXPECT_NEAR(
      std::log2(peak_resolution(tried) / peak_resolution(try_resolutions({room}, {}, Executor(2)))),
      0.0,
      0.5);
}

TEST(CloudMap, Slow_TurnsAndScalesBeforeItLooks) {
  const TemporaryFolder folder;
  std::vector<Vector3d> turned;
  for (const Vector3d& p : divided_room(0.06)) {
    turned.emplace_back(1e3 * p.x(), 1e3 * p.z(), -1e3 * p.y());
  }
  const CloudSource room(saved(folder / "millimetres.pcd", turned));
  ImportOptions options;
  options.scale = 0.001;
  options.up = 'y';
  EXPECT_GE(map_clouds({room}, options, Executor(2)).tried.size(), 3u);
  // without a scale they are a place of 10 km with points 60 m apart
  EXPECT_TRUE(try_resolutions({room}, {}, Executor(2)).empty());
}

TEST(CloudMap, FallsBackToTheSpacing) {
  const TemporaryFolder folder;
  const RandomStream random(1, StreamId::kTest, 0);
  std::vector<Vector3d> few;
  for (std::uint64_t i = 0; i < 500; ++i) {
    const auto [x, y] = random.uniform2(i);
    few.emplace_back(x, y, 0.0);
  }
  const CloudSource cloud(saved(folder / "few.pcd", few));
  const CloudMap made = map_clouds({cloud}, {}, Executor(1));
  EXPECT_TRUE(made.tried.empty());
  EXPECT_TRUE(made.map.report.resolution_was_chosen);
  ImportOptions given;
  given.resolution = 0.07;
  const CloudMap as_given = map_clouds({cloud}, given, Executor(1));
  EXPECT_TRUE(as_given.tried.empty());
  EXPECT_EQ(as_given.map.report.resolution, 0.07);
  EXPECT_FALSE(as_given.map.report.resolution_was_tried);
}

}  // namespace
}  // namespace pointflight
