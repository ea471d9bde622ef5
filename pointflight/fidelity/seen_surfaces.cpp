#include "pointflight/fidelity/seen_surfaces.hpp"

#include <algorithm>

#include "pointflight/geometry/internal/grid_cells.hpp"

namespace pointflight {
namespace {

constexpr double kReach = 1e4;  // m from the origin: whole numbers of cells

constexpr double kNear = Support::kRadius;  // and the width of cells

/// Eighth of a cell that a position lies in, and quarter of a face of the cube around that a
/// direction goes through: 0 to 191.
std::uint8_t kind_of(const Vector3f& from_corner, const Vector3f& direction) {
  int axis = 0;
  direction.cwiseAbs().maxCoeff(&axis);
  auto kind = static_cast<unsigned>(axis);
  for (int k = 0; k < 3; ++k) kind = 2 * kind + (direction[k] < 0.0f ? 1 : 0);
  constexpr auto kHalf = static_cast<float>(Support::kCell);
  for (int k = 0; k < 3; ++k) kind = 2 * kind + (from_corner[k] < kHalf ? 1 : 0);
  return static_cast<std::uint8_t>(kind);
}

bool is_in_reach(const Vector3d& p) {
  return p.allFinite() && p.cwiseAbs().maxCoeff() < kReach;
}

}  // namespace

void SeenSurfaces::add(const SurveyRay& ray) {
  if (!ray.is_return) return;
  const Vector3d p = ray.point_world();
  if (!is_in_reach(p)) return;
  const GridCell cell = grid_cell(p, kNear);
  const Vector3f from_corner = (p - grid_corner(cell, kNear)).cast<float>();
  const std::uint8_t kind = kind_of(from_corner, ray.direction_world);
  std::vector<Return>& returns = cells_[grid_key(cell)];
  const bool known = std::any_of(
      returns.begin(), returns.end(), [&](const Return& other) { return other.kind == kind; });
  if (!known) returns.push_back({from_corner, ray.direction_world, kind});
}

bool SeenSurfaces::has(const Vector3d& point_world, const Vector3f& normal_world) const {
  if (!is_in_reach(point_world)) return false;
  const GridCell middle = grid_cell(point_world, kNear);
  for (std::int64_t i = 0; i < 27; ++i) {
    const GridCell near = neighbour(middle, i);
    const auto cell = cells_.find(grid_key(near));
    if (cell == cells_.end()) continue;
    const Vector3f p = (point_world - grid_corner(near, kNear)).cast<float>();
    const bool seen =
        std::any_of(cell->second.begin(), cell->second.end(), [&](const Return& known) {
          return (known.from_corner - p).norm() <= static_cast<float>(kNear) &&
                 known.direction_world.dot(normal_world) < 0.0f;
        });
    if (seen) return true;
  }
  return false;
}

SeenSurfaces surfaces_of(const SurveyOpener& survey) {
  SeenSurfaces seen;
  const auto reader = survey();
  std::vector<SurveyRay> batch;
  while (reader->read(batch)) {
    for (const SurveyRay& ray : batch) seen.add(ray);
  }
  return seen;
}

}  // namespace pointflight
