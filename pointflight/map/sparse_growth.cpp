#include "pointflight/map/sparse_growth.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <map>
#include <optional>

#include "pointflight/map/covariance_axes.hpp"

namespace pointflight {
namespace {

constexpr double kBlock = 3.0;   // m
constexpr double kSparse = 4.0;  // points a cell
constexpr std::size_t kEnoughCells = 7;
constexpr std::int32_t kWidest = 3;  // cells to each side: 7^3

using BlockKey = std::array<std::int32_t, 3>;

BlockKey block_of(const VoxelGrid& grid, const VoxelCell& cell) {
  BlockKey key{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    key[axis] =
        static_cast<std::int32_t>(std::floor(cell.voxel[axis] * grid.resolution() / kBlock));
  }
  return key;
}

/// Blocks whose median planar cell has too few points.
std::map<BlockKey, bool> sparse_blocks(const VoxelGrid& grid,
                                       const std::vector<BuildSurfel>& surfels) {
  std::map<BlockKey, std::vector<std::uint32_t>> counts;
  for (std::size_t i = 0; i < surfels.size(); ++i) {
    if (surfels[i].s[0] > kPlanarThickness) continue;
    counts[block_of(grid, grid.cells()[i])].push_back(grid.cells()[i].n);
  }
  std::map<BlockKey, bool> sparse;
  for (auto& [key, n] : counts) {
    const auto middle = n.begin() + static_cast<std::ptrdiff_t>(n.size() / 2);
    std::nth_element(n.begin(), middle, n.end());
    sparse[key] = static_cast<double>(*middle) < kSparse;
  }
  return sparse;
}

/// The occupied cells around one, as moments about it and distances of their centroids, metres.
struct Surroundings {
  Moments moments;
  std::vector<double> distances;
};

Surroundings surroundings_of(const VoxelGrid& grid,
                             NeighbourWindow& window,
                             const VoxelCell& cell,
                             std::int32_t reach) {
  Surroundings around;
  const Vector3d own = cell.moments().mean();
  window.for_each(cell, reach, [&](const VoxelCell& other, int dx, int dy, int dz) {
    const Vector3d mean = other.moments().mean() + grid.resolution() * Vector3d(dx, dy, dz);
    around.distances.push_back((mean - own).norm());
  });
  return around;
}

/// The widened surfel, or nothing where the surroundings are not planar.
std::optional<BuildSurfel> widened(const VoxelGrid& grid,
                                   NeighbourWindow& window,
                                   const VoxelCell& cell,
                                   const BuildSurfel& surfel) {
  Surroundings around;
  for (std::int32_t reach = 1; reach <= kWidest; ++reach) {
    around = surroundings_of(grid, window, cell, reach);
    if (around.distances.size() < kEnoughCells) continue;
    around.moments = window.moments(cell, reach);
    break;
  }
  if (around.distances.size() < kEnoughCells) return std::nullopt;
  const CovarianceAxes axes = covariance_axes(around.moments.covariance());
  const Vector3d& l = axes.lambda;
  if (!(l[0] < 0.05 * l[1] && l[1] > 0.1 * l[2])) return std::nullopt;
  // the first is the cell itself
  std::nth_element(around.distances.begin(), around.distances.begin() + 4, around.distances.end());
  const double r = grid.resolution();
  const double factor = std::clamp(around.distances[4] / (1.25 * r), 1.0, 3.0);
  BuildSurfel wide = surfel;
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

std::uint64_t grow_sparse_surfels(const VoxelGrid& grid,
                                  std::vector<BuildSurfel>& surfels,
                                  const Executor& executor) {
  const auto sparse = sparse_blocks(grid, surfels);
  std::atomic<std::uint64_t> grown{0};
  executor.parallel_for(surfels.size(), 2048, [&](std::size_t begin, std::size_t end) {
    NeighbourWindow window(grid);
    for (std::size_t i = begin; i < end; ++i) {
      const VoxelCell& cell = grid.cells()[i];
      if (cell.n >= kSparse) continue;
      const auto block = sparse.find(block_of(grid, cell));
      if (block == sparse.end() || !block->second) continue;
      if (const auto wide = widened(grid, window, cell, surfels[i])) {
        surfels[i] = *wide;
        ++grown;
      }
    }
  });
  return grown;
}

}  // namespace pointflight
