#include "pointflight/map/surfel_fit.hpp"

#include <algorithm>
#include <cmath>

#include "pointflight/geometry/morton.hpp"
#include "pointflight/map/covariance_axes.hpp"

namespace pointflight {
namespace {

constexpr double kPriorPoints = 8.0;
// share of the surroundings' spread that a cell without a plane may have: less leaks at thin
// things, more draws them fatter (docs/fidelity.md)
constexpr double kLoosePrior = 0.65;
// planar surroundings with few points: a cell's own spread is chance, and where it comes out small
// beams get through the wall; above, it tells how much of the cell the surface fills
constexpr double kWatertight = 0.28;  // r; a filled cell has 0.289
constexpr double kTrustedPoints = 40.0;

/// Frame with the plane's normal first and the cell's own longest direction last.
Matrix3d planar_frame(const CovarianceAxes& plane, const CovarianceAxes& own) {
  const Vector3d normal = plane.vectors.col(0);
  Vector3d longest = own.vectors.col(2) - own.vectors.col(2).dot(normal) * normal;
  if (longest.squaredNorm() < 1e-6) longest = plane.vectors.col(2);
  longest.normalize();
  Matrix3d frame;
  frame << normal, longest.cross(normal), longest;
  return frame;
}

BuildSurfel fit(const VoxelGrid& grid, NeighbourWindow& window, const VoxelCell& cell) {
  const double r = grid.resolution();
  const double cell_variance = r * r / 12.0;  // of a plane that fills the cell, per axis
  const Moments own = cell.moments();
  const Moments near = window.moments(cell, 1);
  const CovarianceAxes around = covariance_axes(near.covariance());
  Matrix3d own_covariance = own.covariance();
  if (!own_covariance.allFinite()) own_covariance.setZero();
  const CovarianceAxes inside = covariance_axes(own_covariance);

  const double thickness = std::sqrt(around.lambda[0]);
  const bool neighbours_planar =
      near.n >= 5.0 && thickness < 0.15 * r && around.lambda[0] < 0.15 * around.lambda[1];
  const bool own_planar = own.n >= 5.0 && inside.lambda[0] < 0.05 * inside.lambda[1];
  const bool planar = neighbours_planar || own_planar;
  const Matrix3d frame = neighbours_planar ? planar_frame(around, inside) : inside.vectors;

  BuildSurfel surfel;
  Vector3d s;
  for (int k = 0; k < 3; ++k) {
    const Vector3d axis = frame.col(k);
    const double variance = axis.dot(own_covariance * axis);
    double prior = cell_variance;
    if (!planar) {
      prior = std::min(prior, kLoosePrior * around.lambda[k]);
    } else if (k == 1 && around.lambda[1] < 0.1 * around.lambda[2]) {
      prior = std::min(prior, around.lambda[1]);
    }
    const double unbiased = own.n > 1.0 ? own.n / (own.n - 1.0) : 1.0;
    double shrunk = (own.n * variance + kPriorPoints * prior) / (own.n + kPriorPoints) * unbiased;
    if (own.n == 1.0) {
      // one point says nothing of its spread: a filled cell, thinner across lines
      shrunk = std::min(cell_variance, std::max(around.lambda[k], 0.12 * 0.12 * r * r));
    }
    s[k] = std::sqrt(std::max(0.0, shrunk)) / r;
  }
  if (planar) s[0] = static_cast<double>(kPlanarThickness);
  const bool surface = neighbours_planar && around.lambda[1] >= 0.1 * around.lambda[2];
  const double floor = surface && own.n <= kTrustedPoints ? kWatertight : double{kMinSpread};
  s[1] = std::clamp(s[1], floor, 0.45);
  s[2] = std::clamp(s[2], floor, 0.45);
  Matrix3d ordered = frame;
  if (s[1] > s[2]) {
    std::swap(s[1], s[2]);
    ordered.col(1) = frame.col(2);
    ordered.col(2) = frame.col(1);
  }
  surfel.axes = ordered.cast<float>();
  surfel.s = s.cast<float>();
  const Vector3d center = own.mean() / r;
  surfel.center_in_voxel = (center.array() + 0.5).max(0.0).min(1.0).matrix().cast<float>();
  return surfel;
}

}  // namespace

std::vector<BuildSurfel> fit_surfels(const VoxelGrid& grid,
                                     const std::array<std::int32_t, 3>& min_voxel,
                                     const Executor& executor) {
  const auto& cells = grid.cells();
  std::vector<BuildSurfel> surfels(cells.size());
  executor.parallel_for(cells.size(), 2048, [&](std::size_t begin, std::size_t end) {
    NeighbourWindow window(grid);
    for (std::size_t i = begin; i < end; ++i) {
      surfels[i] = fit(grid, window, cells[i]);
      const auto& v = cells[i].voxel;
      surfels[i].morton = morton_encode(static_cast<std::uint32_t>(v[0] - min_voxel[0]),
                                        static_cast<std::uint32_t>(v[1] - min_voxel[1]),
                                        static_cast<std::uint32_t>(v[2] - min_voxel[2]));
    }
  });
  return surfels;
}

}  // namespace pointflight
