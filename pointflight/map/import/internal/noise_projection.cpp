#include "pointflight/map/import/internal/noise_projection.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "pointflight/map/internal/covariance_axes.hpp"

namespace pointflight {
namespace {

constexpr double kWorthwhile = 0.05;  // cells
// a plane's neighbourhood is no thicker than the largest of 2.5 sigma and these: rooms that were
// scanned while walking have walls of 2 to 3 cm, and coarse cells cannot tell faces that near apart
constexpr double kThickest = 0.020;  // m
constexpr double kThickestInCells = 0.35;
constexpr std::size_t kSampledCells = 200000;
constexpr double kNoiseShare = 0.2;  // percentile

/// l1 of a full plane of a neighbourhood `2 reach + 1` cells wide.
double full_plane_variance(const VoxelGrid& grid, std::int32_t reach) {
  const double width = (2 * reach + 1) * grid.resolution();
  return width * width / 12.0;
}

/// Thickness of the planar neighbourhood of a cell, or negative if there is none.
double thickness_around(const VoxelGrid& grid, NeighbourWindow& window, const VoxelCell& cell) {
  for (const std::int32_t reach : {1, 2}) {
    const Moments around = window.moments(cell, reach);
    if (around.n < 6.0) continue;
    const Vector3d l = covariance_axes(around.covariance()).lambda;
    if (l[0] < 0.1 * l[1] && l[1] > 0.25 * full_plane_variance(grid, reach)) {
      return std::sqrt(l[0]);
    }
  }
  return -1.0;
}

enum class Fate : std::uint8_t { kUnchanged, kKept, kProjected, kTooThick };

struct MovedCell {
  VoxelCell cell;
  Fate fate = Fate::kUnchanged;
};

/// The points of a cell with another mean and covariance (about the mean), in the cell if they
/// are then.
VoxelCell cell_with(const VoxelFrame& frame,
                    const VoxelCell& cell,
                    const Vector3d& mean_world,
                    const Matrix3d& covariance) {
  const auto place = frame.place_of(mean_world);
  if (!place) return cell;
  VoxelCell result;
  result.voxel = place->voxel;
  result.n = cell.n;
  result.intensity_sum = cell.intensity_sum;
  const Vector3d& q = place->in_cell;
  const Matrix3d products = cell.n * (covariance + q * q.transpose());
  std::size_t k = 0;
  for (int row = 0; row < 3; ++row) {
    result.sum[static_cast<std::size_t>(row)] = static_cast<float>(cell.n * q[row]);
    for (int column = row; column < 3; ++column) {
      result.products[k++] = static_cast<float>(products(row, column));
    }
  }
  return result;
}

MovedCell moved(const VoxelGrid& grid,
                NeighbourWindow& window,
                const VoxelCell& cell,
                double thickest) {
  const Moments own = cell.moments();
  const Matrix3d covariance = own.covariance();
  if (own.n >= 10.0) {
    const Vector3d l = covariance_axes(covariance).lambda;
    if (l[0] < 0.05 * l[1]) return {cell, Fate::kKept};
  }
  for (const std::int32_t reach : {1, 2, 3}) {
    const Moments around = window.moments(cell, reach);
    if (around.n < 6.0) continue;
    const CovarianceAxes axes = covariance_axes(around.covariance());
    const Vector3d& l = axes.lambda;
    if (!(l[0] < 0.15 * l[1] && l[1] > 0.25 * full_plane_variance(grid, reach))) continue;
    if (std::sqrt(l[0]) > thickest) return {cell, Fate::kTooThick};
    const Vector3d normal = axes.vectors.col(0);
    const Vector3d mean =
        grid.frame().centroid_world(cell) - normal * normal.dot(own.mean() - around.mean());
    const Matrix3d flat = Matrix3d::Identity() - normal * normal.transpose();
    return {cell_with(grid.frame(), cell, mean, flat * covariance * flat), Fate::kProjected};
  }
  return {cell, Fate::kUnchanged};
}

/// Brings moved cells, which lie where they came from, into order again; those at one voxel merge.
CellTiles sorted(const CellTiles& from,
                 const ScratchArray<VoxelCell>& moved,
                 const Executor& executor,
                 Scratch& scratch) {
  // the few that left their tile, in the order of where they went
  std::vector<std::vector<std::size_t>> left(from.tiles().size());
  from.for_each_tile(executor, [&](std::size_t t, std::span<VoxelCell>) {
    const CellTile& tile = from.tiles()[t];
    for (std::size_t i = tile.begin; i < tile.end; ++i) {
      if (tile_key(moved[i].voxel) != tile.key) left[t].push_back(i);
    }
  });
  struct Arrival {
    std::uint64_t key;
    std::size_t index;
  };
  std::vector<Arrival> arrivals;
  for (const auto& indices : left) {
    for (const std::size_t i : indices) arrivals.push_back({tile_key(moved[i].voxel), i});
  }
  std::stable_sort(arrivals.begin(), arrivals.end(), [](const Arrival& a, const Arrival& b) {
    return a.key < b.key;
  });
  // tiles that were there and new ones, each with room for all that may be in it
  struct Target {
    CellTile tile;
    CellTile source;  // empty for a new tile
    std::span<const Arrival> arrivals;
  };
  std::vector<Target> targets;
  std::size_t room = 0;
  std::size_t arrived = 0;
  const auto add_target = [&](const CellTile& source) {
    const std::size_t first = arrived;
    while (arrived < arrivals.size() && arrivals[arrived].key == source.key) ++arrived;
    const auto here = std::span<const Arrival>(arrivals).subspan(first, arrived - first);
    targets.push_back({{source.key, room, room}, source, here});
    room += source.count() + here.size();
  };
  for (const CellTile& tile : from.tiles()) {
    while (arrived < arrivals.size() && arrivals[arrived].key < tile.key) {
      add_target({arrivals[arrived].key, 0, 0});
    }
    add_target(tile);
  }
  while (arrived < arrivals.size()) add_target({arrivals[arrived].key, 0, 0});

  ScratchArray<VoxelCell> cells(scratch, room);
  executor.parallel_for(targets.size(), 1, [&](std::size_t t, std::size_t) {
    Target& target = targets[t];
    VoxelGrid merged(from.frame());
    for (std::size_t i = target.source.begin; i < target.source.end; ++i) {
      if (tile_key(moved[i].voxel) == target.tile.key) merged.add(moved[i]);
    }
    for (const Arrival& arrival : target.arrivals) merged.add(moved[arrival.index]);
    for (const std::uint32_t cell : merged.morton_order()) {
      cells[target.tile.end++] = merged.cells()[cell];
    }
    cells.release(target.tile.begin, target.tile.end);
    moved.release(target.source.begin, target.source.end);
  });
  std::vector<CellTile> tiles;
  for (const Target& target : targets) {
    if (target.tile.count() > 0) tiles.push_back(target.tile);
  }
  return {from.frame(), std::move(cells), std::move(tiles)};
}

}  // namespace

double estimate_noise(const CellTiles& cells, const Executor& executor) {
  const std::size_t stride = std::max<std::size_t>(1, cells.count() / kSampledCells);
  const std::vector<std::size_t> first = cells.first_numbers();
  std::vector<std::vector<double>> of_tile(cells.tiles().size());
  cells.for_each_view(executor, 2, [&](TileView& view) {
    NeighbourWindow window(view.grid);
    const std::size_t number = first[view.tile];
    for (std::size_t i = (stride - number % stride) % stride; i < view.count; i += stride) {
      const double thickness = thickness_around(view.grid, window, view.grid.cells()[i]);
      if (thickness >= 0.0) of_tile[view.tile].push_back(thickness);
    }
  });
  std::vector<double> thickness;
  for (const auto& t : of_tile) thickness.insert(thickness.end(), t.begin(), t.end());
  if (thickness.empty()) return 0.0;
  const auto at = thickness.begin() +
                  static_cast<std::ptrdiff_t>(kNoiseShare * static_cast<double>(thickness.size()));
  std::nth_element(thickness.begin(), at, thickness.end());
  return *at;
}

bool needs_projection(const CellTiles& cells, double sigma) {
  return sigma > kWorthwhile * cells.resolution();
}

CellTiles project_noise(const CellTiles& cells,
                        double sigma,
                        const Executor& executor,
                        Scratch& scratch,
                        ProjectionReport& report,
                        const Progress& progress) {
  const double thickest = std::max({2.5 * sigma, kThickest, kThickestInCells * cells.resolution()});
  ScratchArray<VoxelCell> results(scratch, cells.capacity());
  std::vector<ProjectionReport> of_tile(cells.tiles().size());
  const auto move_tile = [&](TileView& view) {
    NeighbourWindow window(view.grid);
    ProjectionReport& counts = of_tile[view.tile];
    for (std::size_t i = 0; i < view.count; ++i) {
      const MovedCell result = moved(view.grid, window, view.grid.cells()[i], thickest);
      counts.kept += result.fate == Fate::kKept ? 1 : 0;
      counts.projected += result.fate == Fate::kProjected ? 1 : 0;
      counts.too_thick += result.fate == Fate::kTooThick ? 1 : 0;
      results[view.begin + i] = result.cell;
    }
    results.release(view.begin, view.begin + view.count);
  };
  cells.for_each_view(executor, 3, move_tile, progress, "taking the noise out");
  for (const ProjectionReport& counts : of_tile) {
    report.kept += counts.kept;
    report.projected += counts.projected;
    report.too_thick += counts.too_thick;
  }
  return sorted(cells, results, executor, scratch);
}

}  // namespace pointflight
