#include "pointflight/map/noise_projection.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "pointflight/map/covariance_axes.hpp"

namespace pointflight {
namespace {

constexpr double kWorthwhile = 0.05;  // cells
constexpr double kThickest = 0.020;   // m, or 2.5 sigma
constexpr std::size_t kSampledCells = 200000;
constexpr double kNoiseShare = 0.2;  // percentile

/// l1 of a full plane of a neighbourhood `2 reach + 1` cells wide.
double full_plane_variance(const VoxelGrid& grid, std::int32_t reach) {
  const double width = (2 * reach + 1) * grid.resolution();
  return width * width / 12.0;
}

/// Thickness of the planar neighbourhood of a cell, or negative where there is none.
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

/// A cell's points as mean and covariance in the world.
struct MovedCell {
  Vector3d mean_world;
  Matrix3d covariance;
  Fate fate = Fate::kUnchanged;
};

MovedCell moved(const VoxelGrid& grid,
                NeighbourWindow& window,
                const VoxelCell& cell,
                double thickest) {
  const Moments own = cell.moments();
  MovedCell result{grid.centroid_world(cell), own.covariance(), Fate::kUnchanged};
  if (own.n >= 10.0) {
    const Vector3d l = covariance_axes(result.covariance).lambda;
    if (l[0] < 0.05 * l[1]) {
      result.fate = Fate::kKept;
      return result;
    }
  }
  for (const std::int32_t reach : {1, 2, 3}) {
    const Moments around = window.moments(cell, reach);
    if (around.n < 6.0) continue;
    const CovarianceAxes axes = covariance_axes(around.covariance());
    const Vector3d& l = axes.lambda;
    if (!(l[0] < 0.15 * l[1] && l[1] > 0.25 * full_plane_variance(grid, reach))) continue;
    if (std::sqrt(l[0]) > thickest) {
      result.fate = Fate::kTooThick;
      return result;
    }
    const Vector3d normal = axes.vectors.col(0);
    result.mean_world -= normal * normal.dot(own.mean() - around.mean());
    const Matrix3d flat = Matrix3d::Identity() - normal * normal.transpose();
    result.covariance = flat * result.covariance * flat;
    result.fate = Fate::kProjected;
    return result;
  }
  return result;
}

}  // namespace

double estimate_noise(const VoxelGrid& grid, const Executor& executor) {
  const auto& cells = grid.cells();
  const std::size_t stride = std::max<std::size_t>(1, cells.size() / kSampledCells);
  std::vector<double> thickness((cells.size() + stride - 1) / stride);
  executor.parallel_for(thickness.size(), 2048, [&](std::size_t begin, std::size_t end) {
    NeighbourWindow window(grid);
    for (std::size_t i = begin; i < end; ++i) {
      thickness[i] = thickness_around(grid, window, cells[i * stride]);
    }
  });
  std::erase_if(thickness, [](double t) { return t < 0.0; });
  if (thickness.empty()) return 0.0;
  const auto at = thickness.begin() +
                  static_cast<std::ptrdiff_t>(kNoiseShare * static_cast<double>(thickness.size()));
  std::nth_element(thickness.begin(), at, thickness.end());
  return *at;
}

bool needs_projection(const VoxelGrid& grid, double sigma) {
  return sigma > kWorthwhile * grid.resolution();
}

VoxelGrid project_noise(const VoxelGrid& grid,
                        double sigma,
                        const Executor& executor,
                        ProjectionReport& report) {
  const auto& cells = grid.cells();
  const double thickest = std::max(2.5 * sigma, kThickest);
  std::vector<MovedCell> results(cells.size());
  executor.parallel_for(cells.size(), 2048, [&](std::size_t begin, std::size_t end) {
    NeighbourWindow window(grid);
    for (std::size_t i = begin; i < end; ++i) results[i] = moved(grid, window, cells[i], thickest);
  });
  VoxelGrid projected(grid.base_world(), grid.resolution());
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const MovedCell& r = results[i];
    report.kept += r.fate == Fate::kKept ? 1 : 0;
    report.projected += r.fate == Fate::kProjected ? 1 : 0;
    report.too_thick += r.fate == Fate::kTooThick ? 1 : 0;
    projected.add(r.mean_world, r.covariance, cells[i].n, cells[i].intensity_sum);
  }
  return projected;
}

}  // namespace pointflight
