#include "pointflight/map/import/internal/sparse_growth.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <optional>

#include "pointflight/map/import/internal/surfel_fit.hpp"
#include "pointflight/map/internal/covariance_axes.hpp"

namespace pointflight {
namespace {

constexpr std::size_t kEnoughCells = 7;
constexpr std::int32_t kWidest = 3;  // cells to each side: 7^3

/// The widened surfel, or nothing if the surroundings are not planar.
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
                                  const std::vector<bool>& covered,
                                  const SparseBlocks& blocks,
                                  const Executor& executor,
                                  const Progress& progress) {
  const std::vector<std::size_t> first = cells.first_numbers();
  const auto is_thin = [&](const VoxelCell& cell, SparseSearch& search) {
    return cell.n < kSparsePoints && search.contain(cells.resolution(), cell);
  };
  std::vector<char> has_thin(cells.tiles().size(), 0);
  cells.for_each_tile(executor, [&](std::size_t t, std::span<VoxelCell> own) {
    SparseSearch search(blocks);
    const auto thin = [&](const VoxelCell& cell) { return is_thin(cell, search); };
    has_thin[t] = std::any_of(own.begin(), own.end(), thin) ? 1 : 0;
  });
  std::vector<std::size_t> thin;
  for (std::size_t t = 0; t < has_thin.size(); ++t) {
    if (has_thin[t] != 0) thin.push_back(t);
  }
  std::atomic<std::uint64_t> grown{0};
  const auto widen = [&](TileView& view) {
    NeighbourWindow window(view.grid);
    SparseSearch search(blocks);
    std::vector<double> squared;
    for (std::size_t i = 0; i < view.count; ++i) {
      const VoxelCell& cell = view.grid.cells()[i];
      if (!is_thin(cell, search) || (!covered.empty() && covered[first[view.tile] + i])) continue;
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
