#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstring>

#include "pointflight/core/hash.hpp"
#include "pointflight/core/random.hpp"
#include "pointflight/io/pcd_writer.hpp"
#include "pointflight/map/import/map_builder.hpp"
#include "pointflight/map/import/spacing.hpp"
#include "tests/map/small_room.hpp"
#include "tests/support.hpp"

namespace pointflight {
namespace {

using testing::cloud_of;
using testing::error_of;
using testing::expect_contains;
using testing::import_points;
using testing::map_of;
using testing::small_room;
using testing::TemporaryFolder;

TEST(Import, SurfelsOfAPlaneLieOnItWithItsNormal) {
  ShapeScene plane;
  const Vector3d normal = Vector3d(0.3, -0.2, 0.93).normalized();
  const Vector3d u = normal.cross(Vector3d::UnitX()).normalized();
  plane.add_rectangle({1, 2, 3}, 4.0 * u, 4.0 * normal.cross(u));
  const auto map = map_of(plane, 0.05);
  std::size_t count = 0;
  std::size_t planar = 0;
  map->for_each_surfel([&](const Vector3d& p, const Vector3d& n, double, std::uint32_t word) {
    ++count;
    planar += is_planar(map->words()[word]) ? 1 : 0;
    EXPECT_LT(std::abs((p - Vector3d(1, 2, 3)).dot(normal)), 0.05 / 64.0 + 1e-5);
    EXPECT_GT(std::abs(n.dot(normal)), 0.99);
  });
  EXPECT_EQ(count, map->surfel_count());
  EXPECT_GT(static_cast<double>(planar), 0.99 * static_cast<double>(count));
  map->verify();
}

TEST(Import, OnlyWhereASurfaceGoesOnSurfelsAreWidened) {
  ShapeScene plane;
  plane.add_rectangle({0, 0, 0}, {2, 0, 0}, {0, 2, 0});
  const auto map = map_of(plane, 0.1, 60.0);
  // a filled cell has 1 / 12; steps of the words are coarse, so means
  double within = 0.0;
  double at_edge = 0.0;
  std::size_t within_count = 0;
  std::size_t edge_count = 0;
  map->for_each_surfel([&](const Vector3d& center, const Vector3d&, double, std::uint32_t word) {
    const Surfel surfel = decode(map->words()[word]);
    const double inside = std::min({center.x(), center.y(), 2.0 - center.x(), 2.0 - center.y()});
    const auto area = static_cast<double>(surfel.s[1] * surfel.s[2]);
    if (inside > 0.15) {
      within += area;
      ++within_count;
    } else if (inside < 0.05) {
      at_edge += area;
      ++edge_count;
    }
  });
  ASSERT_GT(within_count, 80u);  // most stand for four cells
  ASSERT_GT(edge_count, 50u);
  EXPECT_GT(within / static_cast<double>(within_count), 1.1 / 12.0);
  EXPECT_LT(at_edge / static_cast<double>(edge_count), 1.0 / 12.0);
}

TEST(Import, AMapInUtmCoordinatesIsAsExactAsOneAtZero) {
  const Vector3d shift(500000.0, 5400000.0, 300.0);
  std::vector<Vector3d> here;
  std::vector<Vector3d> there;
  small_room().sample(800.0, 0.0, 1, [&](const Vector3d& p) {
    here.push_back(p);
    there.push_back(p + shift);
  });
  const auto near_map = map_of(here, 0.125);
  const auto far_map = map_of(there, 0.125);
  ASSERT_EQ(near_map->surfel_count(), far_map->surfel_count());
  for (const Vector3d& p : {Vector3d(3, 2, 2), Vector3d(1, 1, 1), Vector3d(5, 4, 0.5)}) {
    const auto a = near_map->nearest(p, 10.0);
    const auto b = far_map->nearest(p + shift, 10.0);
    ASSERT_TRUE(a && b);
    EXPECT_NEAR(a->distance, b->distance, 1e-4);
  }
}

TEST(Import, CountsAndDropsWhatIsNotFinite) {
  auto points = cloud_of(small_room(), 500.0);
  const std::size_t good = points.size();
  points.push_back({{std::nan(""), 0, 0}, 0.0f});
  points.push_back({{0, std::numeric_limits<double>::infinity(), 0}, 0.0f});
  ImportOptions options;
  options.resolution = 0.1;
  const ImportedMap map = import_points(points, options);
  EXPECT_EQ(map.report.points_read, good + 2);
  EXPECT_EQ(map.report.points_not_finite, 2u);
}

TEST(Import, EmptyAndAllNanCloudsAreErrors) {
  ImportOptions options;
  options.resolution = 0.1;
  expect_contains(error_of([&] { import_points({}, options); }), "no points");
  const std::vector<CloudPoint> nan(3, {{std::nan(""), 0, 0}, 0.0f});
  expect_contains(error_of([&] { import_points(nan, options); }), "all 3 points are NaN");
}

TEST(Import, TooWideForTheResolutionIsAnError) {
  ImportOptions options;
  options.resolution = 0.001;
  const std::vector<CloudPoint> points = {
      {{0, 0, 0}, 0}, {{5000, 0, 0}, 0}, {{10000, 0, 0}, 0}, {{15000, 0, 0}, 0}};
  expect_contains(error_of([&] { import_points(points, options); }), "coarser --resolution");
}

TEST(Import, Statistics_MeasuresTheNoiseAndTakesItOut) {
  for (const double noise : {0.0, 0.005, 0.01, 0.02}) {
    SCOPED_TRACE(noise);
    ImportOptions options;
    options.resolution = 0.05;
    const ImportedMap imported = import_points(cloud_of(small_room(), 3200.0, noise), options);
    EXPECT_NEAR(imported.report.noise, noise, 0.12 * noise + 1e-4);
    EXPECT_EQ(imported.report.projection.projected > 0, noise > 0.0025);
    // centres on the floor lie on it
    const auto map =
        SurfelMap::from_bytes(map_bytes(imported.tree, imported.description), "memory");
    double squares = 0.0;
    double count = 0.0;
    map->for_each_surfel([&](const Vector3d& c, const Vector3d&, double, std::uint32_t) {
      const bool on_floor =
          std::abs(c.z()) < 0.1 && c.x() > 0.5 && c.x() < 2.5 && c.y() > 0.5 && c.y() < 1.5;
      squares += on_floor ? c.z() * c.z() : 0.0;
      count += on_floor ? 1.0 : 0.0;
    });
    EXPECT_GT(count, 100.0);
    EXPECT_LT(std::sqrt(squares / count), 0.35 * noise + 2e-4);
  }
}

TEST(Import, LeavesTheFacesOfAPartitionApart) {
  ShapeScene scene;  // 5 cm thick
  scene.add_box({0, 0, 0}, {0.05, 3, 3});
  ImportOptions options;
  options.resolution = 0.05;
  const ImportedMap imported = import_points(cloud_of(scene, 3200.0, 0.005), options);
  const auto map = SurfelMap::from_bytes(map_bytes(imported.tree, imported.description), "memory");
  double worst = 0.0;
  double sum = 0.0;
  double count = 0.0;
  map->for_each_surfel([&](const Vector3d& c, const Vector3d&, double, std::uint32_t) {
    if (c.y() < 0.3 || c.y() > 2.7 || c.z() < 0.3 || c.z() > 2.7) return;
    const double off = std::min(std::abs(c.x()), std::abs(c.x() - 0.05));
    worst = std::max(worst, off);
    sum += off;
    count += 1.0;
  });
  EXPECT_LT(sum / count, 0.008);
  EXPECT_GT(count, 1000.0);
}

TEST(Import, ClosesTheGapsOfAThinScanOnly) {
  // a wall with a point every other cell, and a dense one
  for (const double per_cell : {0.5, 16.0}) {
    SCOPED_TRACE(per_cell);
    ShapeScene scene;
    scene.add_rectangle({0, 0, 0}, {0, 4, 0}, {0, 0, 4});
    ImportOptions options;
    options.resolution = 0.05;
    const ImportedMap imported =
        import_points(cloud_of(scene, per_cell / (0.05 * 0.05), 0.0), options);
    const auto share =
        static_cast<double>(imported.report.grown_surfels + imported.report.wide_surfels) /
        static_cast<double>(imported.report.surfels);
    if (per_cell < 4.0) {
      EXPECT_GT(share, 0.9);
    } else {
      EXPECT_LT(share, 0.01);
    }
  }
}

TEST(Import, AStrayFirstPointDoesNotRefuseTheCloud) {
  std::vector<CloudPoint> points = {{{0, 0, 0}, 0}};
  for (int i = 0; i < 30; ++i) {
    for (int j = 0; j < 30; ++j) points.push_back({{5e5 + 0.1 * i, 5e6 + 0.1 * j, 100.0}, 0});
  }
  ImportOptions options;
  options.resolution = 0.25;
  const ImportedMap map = import_points(points, options);
  EXPECT_EQ(map.report.points_out_of_reach, 1u);
  EXPECT_NEAR(map.description.bounds_world.min.x(), 5e5, 0.3);
}

TEST(Import, PointsGivenTwiceDoNotHideTheSpacing) {
  std::vector<CloudPoint> points;
  for (int twice = 0; twice < 2; ++twice) {
    for (int i = 0; i < 60; ++i) {
      for (int j = 0; j < 60; ++j) points.push_back({{0.02 * i, 0.02 * j, 1.0}, 0.0f});
    }
  }
  EXPECT_NEAR(import_points(points, {}).report.spacing, 0.02, 1e-9);
}

TEST(Import, OnePointMakesAMapOfOneSurfel) {
  const auto map = map_of(std::vector<Vector3d>{{1, 2, 3}}, 0.1);
  EXPECT_EQ(map->surfel_count(), 1u);
  map->verify();
  // a lone point is a small blob, smaller than its cell
  const double gap = map->nearest({1, 2, 4}, 5.0)->distance;
  EXPECT_GT(gap, 0.95);
  EXPECT_LT(gap, 0.99);
}

TEST(Import, TakesStrayPointsOutAndLeavesEvenlySparseGroundIn) {
  auto points = cloud_of(small_room(), 800.0, 0.002);
  // stray points in the room's air, and ground outside with a point every 0.3 m
  const RandomStream random(1, StreamId::kTest, 0);
  constexpr std::size_t kStray = 40;
  for (std::uint64_t i = 0; i < kStray; ++i) {
    points.push_back({{random.uniform(3 * i, 1.0, 5.0),
                       random.uniform(3 * i + 1, 1.0, 4.0),
                       random.uniform(3 * i + 2, 1.9, 2.4)},
                      0.0f});
  }
  for (int i = 0; i < 30; ++i) {
    for (int j = 0; j < 30; ++j) points.push_back({{10.0 + 0.3 * i, 0.3 * j, 0.0}, 0.0f});
  }
  ImportOptions options;
  options.resolution = 0.05;
  const ImportedMap map = import_points(points, options);
  std::size_t stray = 0;
  std::size_t ground = 0;
  for (const CloudPoint& p : map.outliers) {
    stray += p.position.x() < 6.0 && p.position.z() > 1.7 && p.position.z() < 2.6 ? 1 : 0;
    ground += p.position.x() > 9.0 ? 1 : 0;
  }
  EXPECT_GE(stray, kStray * 9 / 10);
  EXPECT_LE(ground, 9u);
  EXPECT_EQ(map.report.outlier_cells, map.outliers.size());
  // and can be switched off
  options.outliers.enabled = false;
  EXPECT_EQ(import_points(points, options).report.outlier_cells, 0u);
}

TEST(Import, ChoosesTheResolutionThatTheSpacingSupports) {
  std::vector<CloudPoint> points;
  for (int i = 0; i < 100; ++i) {
    for (int j = 0; j < 100; ++j) points.push_back({{0.02 * i, 0.02 * j, 1.0}, 0.0f});
  }
  const ImportedMap map = import_points(points, {});
  EXPECT_NEAR(map.report.spacing, 0.02, 1e-9);
  EXPECT_NEAR(map.report.resolution, 0.04, 1e-9);
  EXPECT_TRUE(map.report.resolution_was_chosen);
  EXPECT_NEAR(supported_resolution(0.0257), 0.052, 1e-9);
  EXPECT_NEAR(supported_resolution(1.3), 2.6, 1e-9);
}

TEST(Import, KeepsIntensities) {
  const TemporaryFolder folder;
  auto points = cloud_of(small_room(), 500.0);
  for (CloudPoint& p : points) p.intensity = p.position.z() > 2.9 ? 200.0f : 50.0f;
  write_cloud_pcd(OutputFile(folder / "a.pcd"), points, true);
  ImportOptions options;
  options.resolution = 0.1;
  const Executor executor(1);
  const ImportedMap imported = import_clouds({folder / "a.pcd"}, options, executor);
  write_map(OutputFile(folder / "a.pfmap"), imported.tree, imported.description);
  const auto map = SurfelMap::open(folder / "a.pfmap");
  ASSERT_TRUE(map->has_intensity());
  EXPECT_NEAR(map->intensity(map->nearest({3, 2, 2.95}, 1.0)->word), 200.0f, 1.0f);
  EXPECT_NEAR(map->intensity(map->nearest({1, 1, 0.1}, 1.0)->word), 50.0f, 1.0f);
}

TEST(Import, UpAxisAndScale) {
  // a wall of the plane y = 2000 mm, file y up: world z = 2 m
  std::vector<CloudPoint> points;
  for (int i = 0; i < 50; ++i) {
    for (int j = 0; j < 50; ++j) points.push_back({{20.0 * i, 2000.0, 20.0 * j}, 0.0f});
  }
  ImportOptions options;
  options.resolution = 0.05;
  options.scale = 0.001;
  options.up = 'y';
  const ImportedMap map = import_points(points, options);
  const double step = map.report.resolution / 64.0;  // of a surfel's centre
  EXPECT_NEAR(map.description.bounds_world.min.z(), 2.0, 0.51 * step);
  EXPECT_NEAR(map.description.bounds_world.min.y(), -0.98, 0.51 * step);
}

TEST(Import, Threads_DoesNotDependOnThreads) {
  const auto points = cloud_of(small_room(), 1500.0, 0.004);
  ImportOptions options;
  options.resolution = 0.05;
  std::uint64_t first = 0;
  const TemporaryFolder folder;
  write_cloud_pcd(OutputFile(folder / "a.pcd"), points, false);
  for (const int threads : {1, 2, 8}) {
    const Executor executor(threads);
    const ImportedMap map = import_clouds({folder / "a.pcd"}, options, executor);
    const std::uint64_t hash = hash64(map_bytes(map.tree, map.description));
    if (threads == 1) first = hash;
    EXPECT_EQ(hash, first) << threads << " threads";
  }
}

TEST(Import, MemoryThatIsTooSmallChangesTheRoundingAtMost) {
  const auto points = cloud_of(small_room(), 1500.0, 0.004);
  ImportOptions options;
  options.resolution = 0.05;
  const ImportedMap whole = import_points(points, options);
  options.scratch_memory = 0;
  options.cells_memory = 1 << 20;
  const ImportedMap parts = import_points(points, options);
  EXPECT_EQ(whole.report.cells, parts.report.cells);
  EXPECT_NEAR(
      static_cast<double>(whole.report.surfels), static_cast<double>(parts.report.surfels), 2.0);
  EXPECT_NEAR(whole.report.noise, parts.report.noise, 1e-6);
  options.scratch_folder = "/nowhere";
  expect_contains(error_of([&] { import_points(points, options); }), "/nowhere: no room for");
}

}  // namespace
}  // namespace pointflight
