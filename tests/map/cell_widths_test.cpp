// Wide cells if points are thin, small ones if many lie on something that is not flat.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <map>
#include <vector>

#include "pointflight/core/random.hpp"
#include "pointflight/map/import/internal/small_cells.hpp"
#include "pointflight/map/import/internal/surfel_fit.hpp"
#include "pointflight/map/import/internal/wide_cells.hpp"
#include "pointflight/render/renderer.hpp"
#include "tests/support.hpp"

namespace pointflight {
namespace {

using testing::import_points;

/// Points of a scene, `per_cell` on a square of `resolution`.
std::vector<CloudPoint> points_of(const ShapeScene& scene, double per_cell, double resolution) {
  std::vector<CloudPoint> points;
  scene.sample(per_cell / (resolution * resolution), 0.0, 3, [&](const Vector3d& p) {
    points.push_back({p, 7.0f});
  });
  return points;
}

CellTiles cells_of(const std::vector<CloudPoint>& points,
                   const VoxelFrame& frame,
                   const Executor& executor,
                   Scratch& scratch) {
  CellAccumulator accumulator(frame, executor, scratch);
  accumulator.add(points);
  return accumulator.finish();
}

void expect_same(const VoxelCell& a, const VoxelCell& b) {
  EXPECT_EQ(a.voxel, b.voxel);
  EXPECT_EQ(a.n, b.n);
  EXPECT_TRUE(a.moments().mean().isApprox(b.moments().mean(), 1e-4));
  EXPECT_LT((a.moments().products - b.moments().products).norm(), 1e-5 * a.n);
  EXPECT_FLOAT_EQ(a.intensity_sum, b.intensity_sum);
}

TEST(WiderCells, HoldTheSamePoints) {
  ShapeScene scene;
  scene.shapes.emplace_back(SceneSphere{{1, -2, 0.5}, 4.0});
  const auto points = points_of(scene, 2.0, 0.1);
  const Executor executor(2);
  Scratch scratch;
  const VoxelFrame frame{{0.03, 0.02, -0.01}, 0.1};
  const CellTiles wide = wider_cells(cells_of(points, frame, executor, scratch), executor, scratch);
  const CellTiles truth = cells_of(points, {frame.base_world, 0.2}, executor, scratch);
  ASSERT_EQ(wide.count(), truth.count());
  ASSERT_EQ(wide.tiles().size(), truth.tiles().size());
  for (std::size_t t = 0; t < truth.tiles().size(); ++t) {
    ASSERT_EQ(wide.tiles()[t].key, truth.tiles()[t].key);
    const auto a = wide.cells_of(wide.tiles()[t]);
    const auto b = truth.cells_of(truth.tiles()[t]);
    ASSERT_EQ(a.size(), b.size());
    for (std::size_t i = 0; i < a.size(); ++i) expect_same(a[i], b[i]);
  }
}

template <class Visit>
void for_each_cell(const CellTiles& cells, const Visit& visit) {
  for (const CellTile& tile : cells.tiles()) {
    for (const VoxelCell& cell : cells.cells_of(tile)) visit(cell);
  }
}

/// Shares of an import's surfels: of wide cells, of small ones.
std::array<double, 2> shares(const ShapeScene& scene, double per_cell) {
  ImportOptions options;
  options.resolution = 0.1;
  const ImportedMap map = import_points(points_of(scene, per_cell, 0.1), options);
  const auto all = static_cast<double>(map.report.surfels);
  return {static_cast<double>(map.report.wide_surfels) / all,
          static_cast<double>(map.report.small_surfels) / all};
}

TEST(SurfelScales, FollowTheDensityAndTheForm) {
  ShapeScene wall;
  wall.add_rectangle({0, 0, 0}, {0, 8, 0}, {0, 0, 8});
  EXPECT_GT(shares(wall, 0.7)[0], 0.3) << "a thin wall";
  EXPECT_EQ(shares(wall, 0.7)[1], 0.0);
  EXPECT_LT(shares(wall, 12.0)[0], 0.001) << "a dense wall";
  EXPECT_LT(shares(wall, 12.0)[1], 0.001);
  ShapeScene leaves;  // what stands alone is no surface to bridge
  const RandomStream random(5, StreamId::kTest, 0);
  for (std::uint64_t i = 0; i < 300; ++i) {
    const Vector3d at(random.uniform(4 * i, 0, 8),
                      random.uniform(4 * i + 1, 0, 8),
                      random.uniform(4 * i + 2, 0, 8));
    const auto [u, v] = random.normal2(4 * i + 3);
    leaves.shapes.emplace_back(Disc{at, Vector3d(u, v, 1.0).normalized(), 0.08});
  }
  EXPECT_LT(shares(leaves, 6.0)[0], 0.02) << "leaves";
  ShapeScene rods;  // 3 cm across, seen from all sides
  for (int i = 0; i < 20; ++i) {
    rods.shapes.emplace_back(Cone{{0.4 * i, 0, 0}, {0.4 * i, 2, 5}, 0.03, 0.03});
  }
  EXPECT_GT(shares(rods, 60.0)[1], 0.5) << "rods";
}

TEST(SurfelScales, AThinWallIsTightAndItsEdgeWhereItIs) {
  for (const double per_cell : {0.45, 0.8, 1.3, 2.5}) {
    SCOPED_TRACE(per_cell);
    ShapeScene scene;
    scene.add_rectangle({3, -2, -2}, {0, 4, 0}, {0, 0, 4});
    ImportOptions options;
    options.resolution = 0.05;
    const ImportedMap imported = import_points(points_of(scene, per_cell, 0.05), options);
    EXPECT_LT(imported.report.surfels, 2 * imported.report.cells / 3);
    const auto map = SurfelMap::from_bytes(map_bytes(imported.tree, imported.description), "wall");
    const auto renderer = make_renderer("beam", Scene{map});
    const RandomStream random(9, StreamId::kTest, 0);
    std::size_t lost = 0;
    std::size_t fat = 0;
    constexpr std::uint64_t kBeams = 4000;
    for (std::uint64_t i = 0; i < kBeams; ++i) {
      const auto [u, v] = random.uniform2(i);
      const Vector3d inside(3.0, 3.6 * u - 1.8, 3.6 * v - 1.8);
      const Vector3d outside(3.0, 2.12, 3.6 * v - 1.8);
      const auto hits = [&](const Vector3d& at) {
        const Ray ray{Vector3d::Zero(), at.normalized().cast<float>(), 10.0f};
        return renderer->trace(ray).is_return();
      };
      lost += hits(inside) ? 0 : 1;
      fat += hits(outside) ? 1 : 0;
    }
    // with cells of one size 9.9, 5.4, 2.7 and 1.0 %
    EXPECT_LT(lost, kBeams / 80);
    EXPECT_LT(fat, kBeams / 20);
  }
}

TEST(MergedCells, StandForTheMiddleOfAPlaneAndNotForItsEdge) {
  for (const double noise : {0.0, 0.004}) {
    SCOPED_TRACE(noise);
    ShapeScene scene;
    scene.add_rectangle({3, -2, -2}, {0, 4, 0}, {0, 0, 4});
    std::vector<CloudPoint> points;
    scene.sample(12.0 / (0.05 * 0.05), noise, 3, [&](const Vector3d& p) {
      points.push_back({p, 7.0f});
    });
    ImportOptions options;
    options.resolution = 0.05;
    const ImportedMap imported = import_points(points, options);
    const ImportReport& report = imported.report;
    // noise leaves steps between the cells' planes
    EXPECT_GT(report.merged_surfels, report.surfels / (noise > 0.0 ? 8 : 3));
    EXPECT_LT(report.surfels, noise > 0.0 ? 3 * report.cells / 4 : report.cells / 2);
    EXPECT_EQ(report.wide_surfels, 0u);
    EXPECT_NEAR(report.points_per_cell, 12.0, 3.0) << "as if none were merged";
    const auto map = SurfelMap::from_bytes(map_bytes(imported.tree, imported.description), "wall");
    const auto renderer = make_renderer("beam", Scene{map});
    const RandomStream random(9, StreamId::kTest, 0);
    for (std::uint64_t i = 0; i < testing::repeats(std::uint64_t{20000}); ++i) {
      const auto [u, v] = random.uniform2(i);
      const auto trace = [&](const Vector3d& at) {
        return renderer->trace({Vector3d::Zero(), at.normalized().cast<float>(), 10.0f});
      };
      const Vector3d inside(3.0, 3.9 * u - 1.95, 3.9 * v - 1.95);
      const Hit hit = trace(inside);
      ASSERT_TRUE(hit.is_return()) << inside.transpose();
      EXPECT_NEAR(static_cast<double>(hit.range), inside.norm(), 0.002 + noise);
      EXPECT_FALSE(trace({3.0, 2.06, 3.8 * v - 1.9}).is_return());
    }
  }
}

TEST(MergedCells, BentSurfacesAndCornersKeepTheirCells) {
  ShapeScene round;
  round.shapes.emplace_back(Cone{{0, 0, 0}, {0, 0, 5}, 0.6, 0.6});
  ShapeScene crates;  // all within three wide cells of an edge
  for (int i = 0; i < 6; ++i) crates.add_box({i * 1.0, 0, 0}, {i * 1.0 + 0.4, 0.4, 0.4});
  for (const ShapeScene& scene : {round, crates}) {
    ImportOptions options;
    options.resolution = 0.1;
    EXPECT_EQ(import_points(points_of(scene, 30.0, 0.1), options).report.merged_surfels, 0u);
  }
}

TEST(SmallCells, TakeTheCellsPointsAndNoOthers) {
  ShapeScene scene;
  for (int i = 0; i < 10; ++i) {
    scene.shapes.emplace_back(SceneSphere{{0.9 * i, 0.3 * i, 0.0}, 0.07});
  }
  const auto points = points_of(scene, 200.0, 0.1);
  const Executor executor(2);
  Scratch scratch;
  const VoxelFrame frame{{0.013, 0.021, -0.017}, 0.1};
  const CellTiles cells = cells_of(points, frame, executor, scratch);
  const auto surfels = fit_surfels(cells, executor, scratch);
  SmallCells splitting(
      cells, surfels, std::vector<bool>(cells.count(), false), executor, scratch, 1 << 28);
  ASSERT_FALSE(splitting.empty());
  splitting.add(points);
  const auto pieces = splitting.finish();
  std::map<std::uint64_t, std::pair<std::uint32_t, int>> sums;  // of each cell: points, pieces
  for (const SurfelPiece& piece : pieces) {
    sums[piece.surfel.morton].first += piece.n;
    ++sums[piece.surfel.morton].second;
    EXPECT_EQ(piece.mean_intensity, 7.0f);
    EXPECT_TRUE((decode(piece.surfel.word).center_voxels.array() < 1.0f).all());
  }
  ASSERT_GT(sums.size(), 10u);
  std::size_t split = 0;
  for_each_cell(cells, [&](const VoxelCell& cell) {
    const auto at = sums.find(voxel_key(cell.voxel));
    if (at == sums.end()) return;
    ++split;
    EXPECT_EQ(at->second.first, cell.n);
    EXPECT_NEAR(at->second.second, 5, 3) << "two to eight";
  });
  EXPECT_EQ(split, sums.size());
}

TEST(CellWidths, BoundsAreThoseOfTheSurfels) {
  ShapeScene thin;  // its corners are cells of a point or two that a wide one stands for
  thin.shapes.emplace_back(Triangle{{0, 0, 0}, {6, 0, 0}, {0, 6, 1}});
  thin.shapes.emplace_back(Triangle{{6, 0, 0}, {6, 6, 1}, {0, 6, 1}});
  ImportOptions options;
  options.resolution = 0.1;
  const ImportedMap imported = import_points(points_of(thin, 0.8, 0.1), options);
  ASSERT_GT(imported.report.wide_surfels, 100u);
  const auto map =
      SurfelMap::from_bytes(map_bytes(imported.tree, imported.description), "thin.pfmap");
  Aabb bounds;
  map->for_each_surfel(
      [&](const Vector3d& center, const Vector3d&, double, std::uint32_t) { bounds.add(center); });
  EXPECT_LT((map->bounds_world().min - bounds.min).norm(), 1e-9);
  EXPECT_LT((map->bounds_world().max - bounds.max).norm(), 1e-9);
}

}  // namespace
}  // namespace pointflight
