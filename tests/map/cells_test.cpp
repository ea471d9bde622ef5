#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <set>
#include <vector>

#include "pointflight/core/random.hpp"
#include "pointflight/map/import/internal/cell_accumulator.hpp"
#include "pointflight/map/import/internal/cell_tiles.hpp"

namespace pointflight {
namespace {

TEST(VoxelGrid, MomentsOfACellMatchItsPoints) {
  const VoxelFrame frame{{0, 0, 0}, 1.0};
  VoxelGrid grid(frame);
  const std::vector<Vector3d> points = {{0.1, 0.2, 0.3}, {0.9, 0.4, 0.5}, {0.5, 0.8, 0.1}};
  Vector3d mean = Vector3d::Zero();
  std::vector<CellPoint> placed;
  for (const Vector3d& p : points) {
    const auto place = frame.place_of(p);
    ASSERT_TRUE(place);
    const Vector3f q = place->in_cell.cast<float>();
    placed.push_back({place->voxel, {q.x(), q.y(), q.z()}, 2.0f});
    mean += p / 3.0;
  }
  grid.add(placed);
  Matrix3d covariance = Matrix3d::Zero();
  for (const Vector3d& p : points) covariance += (p - mean) * (p - mean).transpose() / 3.0;
  ASSERT_EQ(grid.cells().size(), 1u);
  EXPECT_TRUE(frame.centroid_world(grid.cells()[0]).isApprox(mean, 1e-6));
  EXPECT_TRUE(grid.cells()[0].moments().covariance().isApprox(covariance, 1e-5));
  EXPECT_EQ(grid.cells()[0].intensity_sum, 6.0f);
  // covariance does not depend on where moments are taken about
  const Moments moved = grid.cells()[0].moments().about({3, -2, 1});
  EXPECT_TRUE(moved.covariance().isApprox(covariance, 1e-5));
  EXPECT_FALSE(frame.place_of({2e6, 0, 0}));
  EXPECT_EQ(frame.place_of({-0.25, 0.0, 7.0})->voxel, (std::array<std::int32_t, 3>{-1, 0, 7}));
}

/// Cells that cross many tiles, with holes.
std::vector<CloudPoint> scattered_points(std::size_t count) {
  const RandomStream random(11, StreamId::kTest, 0);
  std::vector<CloudPoint> points;
  for (std::uint64_t i = 0; i < count; ++i) {
    points.push_back({{random.uniform(3 * i, -70, 70),
                       random.uniform(3 * i + 1, -70, 70),
                       random.uniform(3 * i + 2, -4, 4)},
                      static_cast<float>(i)});
  }
  return points;
}

TEST(VoxelGrid, WindowsSeeEveryNeighbourOnce) {
  const VoxelFrame frame{{0.3, -0.2, 0.1}, 1.0};
  const Executor executor(2);
  Scratch scratch;
  CellAccumulator accumulator(frame, executor, scratch);
  accumulator.add(scattered_points(40000));
  const CellTiles cells = accumulator.finish();
  std::vector<std::array<std::int32_t, 3>> all;
  std::set<std::array<std::int32_t, 3>> occupied;
  for (const CellTile& tile : cells.tiles()) {
    std::uint64_t last = 0;
    for (const VoxelCell& cell : cells.cells_of(tile)) {
      EXPECT_EQ(tile_key(cell.voxel), tile.key);
      EXPECT_GT(voxel_key(cell.voxel), last);
      last = voxel_key(cell.voxel);
      EXPECT_TRUE(occupied.insert(cell.voxel).second);
      all.push_back(cell.voxel);
    }
  }
  EXPECT_EQ(occupied.size(), cells.count());
  for (std::size_t t = 0; t < cells.tiles().size(); ++t) {
    const std::int32_t halo = 4;
    const TileView view = cells.view(t, halo);
    NeighbourWindow window(view.grid);
    for (std::size_t i = 0; i < view.count; i += 97) {
      const VoxelCell& cell = view.grid.cells()[i];
      for (std::int32_t reach = 0; reach <= halo; ++reach) {
        std::size_t expected = 0;
        for (std::int32_t x = -reach; x <= reach; ++x) {
          for (std::int32_t y = -reach; y <= reach; ++y) {
            for (std::int32_t z = -reach; z <= reach; ++z) {
              expected +=
                  occupied.contains({cell.voxel[0] + x, cell.voxel[1] + y, cell.voxel[2] + z});
            }
          }
        }
        std::set<std::array<std::int32_t, 3>> seen;
        window.for_each(cell, reach, [&](const VoxelCell& other, int dx, int dy, int dz) {
          EXPECT_EQ(other.voxel,
                    (std::array<std::int32_t, 3>{
                        cell.voxel[0] + dx, cell.voxel[1] + dy, cell.voxel[2] + dz}));
          EXPECT_TRUE(seen.insert(other.voxel).second);
        });
        EXPECT_EQ(seen.size(), expected);
        std::size_t within = 0;
        view.grid.for_each_within(cell.voxel, reach, [&](std::uint32_t other) {
          EXPECT_TRUE(seen.contains(view.grid.cells()[other].voxel));
          EXPECT_EQ(all[view.index_of(other)], view.grid.cells()[other].voxel);
          ++within;
        });
        EXPECT_EQ(within, expected);
      }
    }
  }
}

TEST(CellAccumulator, RunsInFilesGiveTheSameCells) {
  const VoxelFrame frame{{0.3, -0.2, 0.1}, 1.0};
  const auto points = scattered_points(60000);
  const Executor executor(2);
  const auto cells_with = [&](Scratch& scratch, std::size_t memory) {
    CellAccumulator accumulator(frame, executor, scratch, memory);
    for (std::size_t at = 0; at < points.size(); at += 7000) {
      accumulator.add(std::span(points).subspan(at, std::min<std::size_t>(7000, 60000 - at)));
    }
    return accumulator.finish();
  };
  Scratch memory;
  Scratch files({}, 0);
  const CellTiles whole = cells_with(memory, std::size_t{1} << 30);
  const CellTiles parts = cells_with(files, 0);  // a run each time
  EXPECT_EQ(memory.bytes_in_files(), 0u);
  EXPECT_GT(files.bytes_in_files(), 0u);
  EXPECT_EQ(files.bytes_in_memory(), 0u);
  ASSERT_EQ(whole.count(), parts.count());
  ASSERT_EQ(whole.tiles().size(), parts.tiles().size());
  for (std::size_t t = 0; t < whole.tiles().size(); ++t) {
    const auto a = whole.cells_of(whole.tiles()[t]);
    const auto b = parts.cells_of(parts.tiles()[t]);
    ASSERT_EQ(a.size(), b.size());
    for (std::size_t i = 0; i < a.size(); ++i) {
      ASSERT_EQ(a[i].voxel, b[i].voxel);
      ASSERT_EQ(a[i].n, b[i].n);
      for (std::size_t k = 0; k < 6; ++k) EXPECT_NEAR(a[i].products[k], b[i].products[k], 1e-5);
    }
  }
}

}  // namespace
}  // namespace pointflight
