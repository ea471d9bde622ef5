#include "pointflight/map/sparse_growth.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <map>
#include <optional>

#include "pointflight/map/covariance_axes.hpp"
#include "pointflight/map/surfel_fit.hpp"

namespace pointflight {
namespace {

constexpr double kBlock = 3.0;   // m
constexpr double kSparse = 4.0;  // points per cell
constexpr std::size_t kEnoughCells = 7;
constexpr std::int32_t kWidest = 3;  // cells to each side: 7^3

/// Whole numbers; as doubles, because cells of a hostile file may be thousands of kilometres wide.
using BlockKey = std::array<double, 3>;

BlockKey block_of(double resolution, const VoxelCell& cell) {
  BlockKey key{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    key[axis] = std::floor(cell.voxel[axis] * resolution / kBlock);
  }
  return key;
}

/// Planar cells of a block, and those with too few points.
struct Counts {
  std::size_t all = 0;
  std::size_t sparse = 0;
  [[nodiscard]] bool median_is_sparse() const { return 2 * sparse > all; }
};

using Blocks = std::map<BlockKey, Counts>;

Blocks count_blocks(const CellTiles& cells,
                    const ScratchArray<BuildSurfel>& surfels,
                    const std::vector<std::size_t>& first,
                    const Executor& executor) {
  std::vector<Blocks> of_tile(cells.tiles().size());
  cells.for_each_tile(executor, [&](std::size_t t, std::span<VoxelCell> own) {
    Blocks& blocks = of_tile[t];
    BlockKey last{};
    Counts* counts = nullptr;
    for (std::size_t i = 0; i < own.size(); ++i) {
      if (!is_planar(surfels[first[t] + i].word)) continue;
      const BlockKey key = block_of(cells.resolution(), own[i]);
      if (counts == nullptr || key != last) counts = &blocks[key];
      last = key;
      ++counts->all;
      counts->sparse += own[i].n < kSparse ? 1 : 0;
    }
    surfels.release(first[t], first[t] + own.size());
  });
  Blocks all;
  for (const Blocks& blocks : of_tile) {
    for (const auto& [key, counts] : blocks) {
      all[key].all += counts.all;
      all[key].sparse += counts.sparse;
    }
  }
  return all;
}

/// The widened surfel, or nothing where the surroundings are not planar.
std::optional<Surfel> widened(const VoxelGrid& grid,
                              NeighbourWindow& window,
                              const VoxelCell& cell,
                              std::vector<double>& squared) {
  // distances to the centroids of the occupied cells around, the cell itself included
  const Vector3d own = cell.moments().mean();
  std::int32_t reach = 0;
  do {
    squared.clear();
    window.for_each(cell, ++reach, [&](const VoxelCell& other, int dx, int dy, int dz) {
      const Vector3d mean = other.moments().mean() + grid.resolution() * Vector3d(dx, dy, dz);
      squared.push_back((mean - own).squaredNorm());
    });
  } while (squared.size() < kEnoughCells && reach < kWidest);
  if (squared.size() < kEnoughCells) return std::nullopt;
  const CovarianceAxes axes = covariance_axes(window.moments(cell, reach).covariance());
  const Vector3d& l = axes.lambda;
  if (!(l[0] < 0.05 * l[1] && l[1] > 0.1 * l[2])) return std::nullopt;
  // the first is the cell itself
  std::nth_element(squared.begin(), squared.begin() + 4, squared.end());
  const double r = grid.resolution();
  const double factor = std::clamp(std::sqrt(squared[4]) / (1.25 * r), 1.0, 3.0);
  const Surfel surfel = fit_surfel(grid, window, cell);
  Surfel wide = surfel;
  wide.axes = axes.vectors.cast<float>();
  const double filled = 1.0 / std::sqrt(12.0);
  for (const int k : {1, 2}) {
    const double s = std::max(static_cast<double>(surfel.s[k]), filled);
    wide.s[k] = static_cast<float>(s * factor);
  }
  wide.s[0] = kPlanarThickness;
  return wide;
}

}  // namespace

std::uint64_t grow_sparse_surfels(const CellTiles& cells,
                                  const ScratchArray<BuildSurfel>& surfels,
                                  const Executor& executor,
                                  const Progress& progress) {
  const std::vector<std::size_t> first = cells.first_numbers();
  const Blocks blocks = count_blocks(cells, surfels, first, executor);
  const auto is_thin = [&](const VoxelCell& cell) {
    if (cell.n >= kSparse) return false;
    const auto block = blocks.find(block_of(cells.resolution(), cell));
    return block != blocks.end() && block->second.median_is_sparse();
  };
  std::vector<char> has_thin(cells.tiles().size(), 0);
  cells.for_each_tile(executor, [&](std::size_t t, std::span<VoxelCell> own) {
    has_thin[t] = std::any_of(own.begin(), own.end(), is_thin) ? 1 : 0;
  });
  std::vector<std::size_t> thin;
  for (std::size_t t = 0; t < has_thin.size(); ++t) {
    if (has_thin[t] != 0) thin.push_back(t);
  }
  std::atomic<std::uint64_t> grown{0};
  const auto widen = [&](TileView& view) {
    NeighbourWindow window(view.grid);
    std::vector<double> squared;
    for (std::size_t i = 0; i < view.count; ++i) {
      const VoxelCell& cell = view.grid.cells()[i];
      if (!is_thin(cell)) continue;
      if (const auto wide = widened(view.grid, window, cell, squared)) {
        surfels[first[view.tile] + i].word = encode(*wide);
        ++grown;
      }
    }
    surfels.release(first[view.tile], first[view.tile] + view.count);
  };
  cells.for_each_view_of(thin, executor, kWidest, widen, progress, "closing gaps of thin scans");
  return grown;
}

}  // namespace pointflight
