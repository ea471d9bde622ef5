#include "pointflight/map/import/internal/surfel_fit.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>

#include "pointflight/map/internal/covariance_axes.hpp"

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
// within a surface, where no edge can grow fat
constexpr double kWithin = 0.32;      // r
constexpr double kSameSurface = 0.4;  // r across the plane
constexpr double kFlatAround = 0.05;  // r, deviation across the plane of 3 x 3 x 3 cells

/// Frame with the plane's normal first and the direction within it last in which the cell's own
/// points spread most.
Matrix3d planar_frame(const CovarianceAxes& plane, const Matrix3d& own_covariance) {
  const Vector3d a = plane.vectors.col(1);
  const Vector3d b = plane.vectors.col(2);
  // larger eigenvector of the covariance within the plane, [[p, q], [q, s]]
  const Vector3d ca = own_covariance * a;
  const double q = b.dot(ca);
  const double h = 0.5 * (a.dot(ca) - b.dot(own_covariance * b));
  const double d = std::sqrt(h * h + q * q);
  const double along_a = h >= 0.0 ? h + d : q;
  const double along_b = h >= 0.0 ? q : d - h;
  Vector3d longest = along_a * a + along_b * b;
  if (longest.norm() > 1e-6 * own_covariance.trace()) {
    longest.normalize();
  } else {
    longest = b;
  }
  const Vector3d normal = plane.vectors.col(0);
  Matrix3d frame;
  frame << normal, longest.cross(normal), longest;
  return frame;
}

/// True if the surface goes on from the cell to all sides: neighbours near the plane of `frame` in
/// each of six sectors.
bool lies_within_surface(NeighbourWindow& window,
                         const VoxelCell& cell,
                         const Vector3d& center,
                         const Matrix3d& frame,
                         double r) {
  const Vector3d normal = frame.col(0);
  const Vector3d across = std::sqrt(3.0) * frame.col(1);
  const Vector3d along = frame.col(2);
  std::uint32_t sectors = 0;
  window.for_each(cell, 1, [&](const VoxelCell& other, int dx, int dy, int dz) {
    // the way between the centroids, times the other's points
    const double n = other.n;
    const Vector3d way = Vector3d(other.sum[0], other.sum[1], other.sum[2]) +
                         n * (r * Vector3d(dx, dy, dz) - center);
    if (&other == &cell || std::abs(way.dot(normal)) > kSameSurface * r * n) return;
    const double u = way.dot(across);
    const double v = way.dot(along);
    // three lines through the centre
    const int sector = (v > 0.0 ? 1 : 0) | (v > u ? 2 : 0) | (v > -u ? 4 : 0);
    sectors |= 1u << sector;
  });
  return std::popcount(sectors) == 6;
}

}  // namespace

Surfel fit_surfel(const VoxelGrid& grid, NeighbourWindow& window, const VoxelCell& cell) {
  const double r = grid.resolution();
  const double cell_variance = r * r / 12.0;  // of a plane that fills the cell, per axis
  const Moments own = cell.moments();
  const Moments near = window.moments(cell, 1);
  const CovarianceAxes around = covariance_axes(near.covariance());
  Matrix3d own_covariance = own.covariance();
  if (!own_covariance.allFinite()) own_covariance.setZero();

  const double thickness = std::sqrt(around.lambda[0]);
  const bool neighbours_planar =
      near.n >= 5.0 && thickness < 0.15 * r && around.lambda[0] < 0.15 * around.lambda[1];
  bool planar = neighbours_planar;
  Matrix3d frame;
  if (neighbours_planar) {
    frame = planar_frame(around, own_covariance);
  } else {
    const CovarianceAxes inside = covariance_axes(own_covariance);
    planar = own.n >= 5.0 && inside.lambda[0] < 0.05 * inside.lambda[1];
    frame = inside.vectors;
  }

  Surfel surfel;
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
  double floor = surface && own.n <= kTrustedPoints ? kWatertight : double{kMinSpread};
  if (neighbours_planar && lies_within_surface(window, cell, own.mean(), frame, r)) floor = kWithin;
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
  surfel.center_voxels = (center.array() + 0.5).max(0.0).min(1.0).matrix().cast<float>();
  return surfel;
}

bool lies_amid_plane(const VoxelGrid& grid,
                     NeighbourWindow& window,
                     const VoxelCell& cell,
                     double thickness) {
  const double r = grid.resolution();
  const CovarianceAxes inside = covariance_axes(cell.moments().covariance());
  if (!(inside.lambda[0] <= thickness * thickness)) return false;
  const CovarianceAxes around = covariance_axes(window.moments(cell, 1).covariance());
  if (!(around.lambda[0] <= kFlatAround * kFlatAround * r * r)) return false;
  return lies_within_surface(window, cell, cell.moments().mean(), around.vectors, r);
}

ScratchArray<BuildSurfel> fit_surfels(const CellTiles& cells,
                                      const Executor& executor,
                                      Scratch& scratch,
                                      const Progress& progress) {
  ScratchArray<BuildSurfel> surfels(scratch, cells.count());
  const std::vector<std::size_t> first = cells.first_numbers();
  const auto fit_tile = [&](TileView& view) {
    NeighbourWindow window(view.grid);
    std::size_t to = first[view.tile];
    for (const VoxelCell& cell : view.own()) {
      surfels[to++] = {voxel_key(cell.voxel), encode(fit_surfel(view.grid, window, cell))};
    }
    surfels.release(first[view.tile], to);
  };
  cells.for_each_view(executor, 1, fit_tile, progress, "fitting surfels");
  return surfels;
}

}  // namespace pointflight
