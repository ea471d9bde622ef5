#include "pointflight/fidelity/seen_surfaces.hpp"

#include <algorithm>
#include <cmath>

#include "pointflight/core/math.hpp"
#include "pointflight/geometry/morton.hpp"

namespace pointflight {
namespace {

constexpr int kParts = 2;  // of a cell along each axis, for returns that stand for others
constexpr int kSectorBits = 5;
constexpr double kReach = 1e4;  // m from the origin: 19 bits for each coordinate of a part

using Cell = std::array<std::int64_t, 3>;

Cell cell_of(const Vector3d& p, double width) {
  return {floor_to_integer(p.x() / width),
          floor_to_integer(p.y() / width),
          floor_to_integer(p.z() / width)};
}

Vector3d corner_of(const Cell& cell, double width) {
  return width * Vector3d(static_cast<double>(cell[0]),
                          static_cast<double>(cell[1]),
                          static_cast<double>(cell[2]));
}

std::uint64_t key_of(const Cell& cell) {
  constexpr std::int64_t kMiddle = 1 << 18;
  return morton_encode(static_cast<std::uint32_t>(cell[0] + kMiddle),
                       static_cast<std::uint32_t>(cell[1] + kMiddle),
                       static_cast<std::uint32_t>(cell[2] + kMiddle));
}

/// Quarter of a face of the cube around that a direction goes through, 0 to 23.
std::uint64_t sector_of(const Vector3f& direction) {
  int axis = 0;
  direction.cwiseAbs().maxCoeff(&axis);
  auto sector = static_cast<std::uint64_t>(axis);
  for (int k = 0; k < 3; ++k) sector = 2 * sector + (direction[k] < 0.0f ? 1 : 0);
  return sector;
}

bool is_in_reach(const Vector3d& p) {
  return p.allFinite() && p.cwiseAbs().maxCoeff() < kReach;
}

}  // namespace

void SeenSurfaces::add(const SurveyRay& ray) {
  if (!ray.is_return) return;
  const Vector3d p = ray.point_world();
  if (!is_in_reach(p)) return;
  const std::uint64_t part = key_of(cell_of(p, kNear / kParts));
  if (!kept_.insert(part << kSectorBits | sector_of(ray.direction_world)).second) return;
  const Cell cell = cell_of(p, kNear);
  cells_[key_of(cell)].push_back({(p - corner_of(cell, kNear)).cast<float>(), ray.direction_world});
}

bool SeenSurfaces::has(const Vector3d& point_world, const Vector3f& normal_world) const {
  if (!is_in_reach(point_world)) return false;
  const Cell middle = cell_of(point_world, kNear);
  for (std::int64_t i = 0; i < 27; ++i) {
    const Cell near = {middle[0] + i % 3 - 1, middle[1] + i / 3 % 3 - 1, middle[2] + i / 9 - 1};
    const auto cell = cells_.find(key_of(near));
    if (cell == cells_.end()) continue;
    const Vector3f p = (point_world - corner_of(near, kNear)).cast<float>();
    const bool seen =
        std::any_of(cell->second.begin(), cell->second.end(), [&](const Return& known) {
          return (known.from_cell - p).norm() <= static_cast<float>(kNear) &&
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
