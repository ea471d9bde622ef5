#include "pointflight/map/import/internal/outliers.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

namespace pointflight {
namespace {

constexpr double kStandsOut = 2.0;  // times the mean distance of the neighbours
constexpr double kFarInCells = 10.0;
constexpr std::int32_t kHalo = 4;       // within which nearly all cells have their neighbours
constexpr std::int32_t kWideHalo = 16;  // beyond kFarInCells it no longer matters how far

/// Centroids of the cells of a view, metres from its first cell's corner.
std::vector<Vector3d> centroids_of(const VoxelGrid& grid) {
  const auto& cells = grid.cells();
  std::vector<Vector3d> centroids;
  centroids.reserve(cells.size());
  for (const VoxelCell& cell : cells) {
    Vector3d p;
    const double share = 1.0 / cell.n;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      p[static_cast<int>(axis)] =
          static_cast<double>(cell.sum[axis]) * share +
          grid.resolution() * (cell.voxel[axis] - cells.front().voxel[axis]);
    }
    centroids.push_back(p);
  }
  return centroids;
}

/// A tile with a wide halo: for the few cells whose neighbours are far.
class WideView {
 public:
  WideView(const TileView& view, std::size_t neighbours)
      : view_(view),
        centroids_(centroids_of(view.grid)),
        neighbours_(neighbours),
        farthest_(kWideHalo * view.grid.resolution()) {}

  /// Mean distance of a cell of the tile to its neighbours; calls `visit` with the index in all
  /// cells of each that is not too far.
  template <class Visit>
  double mean_distance(std::size_t cell, const Visit& visit) {
    const VoxelGrid& grid = view_.grid;
    const auto& voxel = grid.cells()[cell].voxel;
    // a cube that is found holds all that are nearer than its sides
    for (const std::int32_t reach : {4, kWideHalo}) {
      found_.clear();
      grid.for_each_within(voxel, reach, [&](std::uint32_t other) {
        if (other == cell) return;
        found_.emplace_back((centroids_[other] - centroids_[cell]).squaredNorm(), other);
      });
      const double side = (reach - 1) * grid.resolution();
      if (found_.size() < neighbours_) continue;
      std::partial_sort(found_.begin(), found_.begin() + offset(neighbours_), found_.end());
      if (found_[neighbours_ - 1].first <= side * side) break;
    }
    const std::size_t count = std::min(neighbours_, found_.size());
    if (count < neighbours_) std::sort(found_.begin(), found_.end());
    double sum = static_cast<double>(neighbours_ - count) * farthest_;
    for (std::size_t j = 0; j < count; ++j) {
      const double distance = std::sqrt(found_[j].first);
      if (distance < farthest_) visit(view_.index_of(found_[j].second));
      sum += std::min(distance, farthest_);
    }
    return sum / static_cast<double>(neighbours_);
  }

 private:
  static std::ptrdiff_t offset(std::size_t i) { return static_cast<std::ptrdiff_t>(i); }

  const TileView& view_;
  std::vector<Vector3d> centroids_;
  std::size_t neighbours_;
  double farthest_;
  std::vector<std::pair<double, std::uint32_t>> found_;
};

/// Mean distance to the nearest neighbours if all of them surely lie within kHalo cells.
class NearView {
 public:
  NearView(const VoxelGrid& grid, std::size_t neighbours)
      : grid_(grid), window_(grid), centroids_(centroids_of(grid)), neighbours_(neighbours) {}

  std::optional<double> mean_distance(std::size_t index) {
    const VoxelCell& cell = grid_.cells()[index];
    const Vector3d& own = centroids_[index];
    const double off_middle = cell.moments().mean().cwiseAbs().maxCoeff();
    for (const std::int32_t reach : {2, kHalo}) {
      squared_.clear();
      window_.for_each(cell, reach, [&](const VoxelCell& other, int, int, int) {
        const auto at = static_cast<std::size_t>(&other - grid_.cells().data());
        squared_.push_back((centroids_[at] - own).squaredNorm());
      });
      if (squared_.size() <= neighbours_) continue;
      // the cell itself is among them, at 0
      const auto last = squared_.begin() + static_cast<std::ptrdiff_t>(neighbours_);
      std::nth_element(squared_.begin(), last, squared_.end());
      // beyond, the cube may have missed some
      const double to_border = (reach + 0.5) * grid_.resolution() - off_middle;
      if (*last > to_border * to_border) continue;
      double sum = 0.0;
      for (auto at = squared_.begin(); at <= last; ++at) sum += std::sqrt(*at);
      return sum / static_cast<double>(neighbours_);
    }
    return std::nullopt;
  }

 private:
  const VoxelGrid& grid_;
  NeighbourWindow window_;
  std::vector<Vector3d> centroids_;
  std::size_t neighbours_;
  std::vector<double> squared_;
};

/// Of all cells, by their index.
struct Distances {
  ScratchArray<float> of_cell;
  double limit = 0.0;
};

Distances measure(const CellTiles& cells,
                  const OutlierOptions& options,
                  const Executor& executor,
                  Scratch& scratch,
                  const Progress& progress) {
  const auto k = static_cast<std::size_t>(options.neighbours);
  Distances distances{ScratchArray<float>(scratch, cells.capacity())};
  struct Sums {
    double first = 0.0;
    double second = 0.0;
  };
  std::vector<Sums> sums(cells.tiles().size());
  const auto measure_tile = [&](TileView& view) {
    NearView near_view(view.grid, k);
    std::optional<TileView> around;
    std::optional<WideView> wide;
    for (std::size_t i = 0; i < view.count; ++i) {
      const auto near = near_view.mean_distance(i);
      if (!near && !wide) {
        around.emplace(cells.view(view.tile, kWideHalo));
        wide.emplace(*around, k);
      }
      const double distance = near ? *near : wide->mean_distance(i, [](std::size_t) {});
      distances.of_cell[view.begin + i] = static_cast<float>(distance);
      sums[view.tile].first += distance;
      sums[view.tile].second += distance * distance;
    }
  };
  cells.for_each_view(executor, kHalo, measure_tile, progress, "looking for outliers");
  Sums all;
  for (const Sums& s : sums) {
    all.first += s.first;
    all.second += s.second;
  }
  const auto count = static_cast<double>(cells.count());
  const double mean = all.first / count;
  const double variance = std::max(0.0, all.second / count - mean * mean);
  distances.limit = mean + options.sigmas * std::sqrt(variance);
  return distances;
}

}  // namespace

Outliers drop_outliers(CellTiles& cells,
                       const OutlierOptions& options,
                       const Executor& executor,
                       Scratch& scratch,
                       const Progress& progress) {
  const auto k = static_cast<std::size_t>(options.neighbours);
  Outliers outliers;
  if (!options.enabled || cells.count() <= k) return outliers;
  const Distances distances = measure(cells, options, executor, scratch, progress);
  const double far = kFarInCells * cells.resolution();
  const auto is_far = [&](std::size_t cell) {
    return static_cast<double>(distances.of_cell[cell]) > distances.limit;
  };
  std::vector<std::size_t> suspects;
  for (std::size_t t = 0; t < cells.tiles().size(); ++t) {
    const CellTile& tile = cells.tiles()[t];
    bool any = false;
    for (std::size_t i = tile.begin; i < tile.end && !any; ++i) any = is_far(i);
    if (any) suspects.push_back(t);
  }
  std::vector<std::vector<std::size_t>> of_tile(cells.tiles().size());
  cells.for_each_view_of(suspects, executor, kWideHalo, [&](TileView& view) {
    WideView wide(view, k);
    for (std::size_t i = 0; i < view.count; ++i) {
      if (!is_far(view.begin + i)) continue;
      double around = 0.0;
      double count = 0.0;
      wide.mean_distance(i, [&](std::size_t neighbour) {
        around += static_cast<double>(distances.of_cell[neighbour]);
        count += 1.0;
      });
      const double distance = static_cast<double>(distances.of_cell[view.begin + i]);
      const bool stands_out = distance * count > kStandsOut * around;
      if (stands_out || distance > far) of_tile[view.tile].push_back(i);
    }
  });
  std::vector<std::size_t> kept;
  for (std::size_t t = 0; t < of_tile.size(); ++t) {
    const std::span<VoxelCell> own = cells.cells_of(cells.tiles()[t]);
    kept.push_back(own.size() - of_tile[t].size());
    if (of_tile[t].empty()) continue;
    std::size_t next = 0;
    std::size_t to = 0;
    for (std::size_t i = 0; i < own.size(); ++i) {
      if (next == of_tile[t].size() || of_tile[t][next] != i) {
        own[to++] = own[i];
        continue;
      }
      ++next;
      outliers.points += own[i].n;
      outliers.centroids_world.push_back({cells.frame().centroid_world(own[i]),
                                          own[i].intensity_sum / static_cast<float>(own[i].n)});
    }
  }
  cells.shrink(kept);
  return outliers;
}

}  // namespace pointflight
