#include "pointflight/fit/surveyed_places.hpp"

#include <array>

#include "pointflight/core/math.hpp"
#include "pointflight/geometry/morton.hpp"

namespace pointflight {
namespace {

constexpr double kCell = 0.1;  // m

using Cell = std::array<std::int64_t, 3>;

std::uint64_t key_of(const Cell& cell) {
  constexpr std::int64_t kMiddle = 1 << 20;
  return morton_encode(static_cast<std::uint32_t>(cell[0] + kMiddle),
                       static_cast<std::uint32_t>(cell[1] + kMiddle),
                       static_cast<std::uint32_t>(cell[2] + kMiddle));
}

Cell cell_of(const Vector3d& p) {
  return {floor_to_integer(p.x() / kCell),
          floor_to_integer(p.y() / kCell),
          floor_to_integer(p.z() / kCell)};
}

/// Of whole numbers of cells; NaN is not.
bool is_in_reach(const Vector3d& p) {
  return p.cwiseAbs().maxCoeff() < 1e9 && p.allFinite();
}

}  // namespace

void SurveyedPlaces::add(const Vector3d& point_world) {
  if (!is_in_reach(point_world)) return;
  cells_.insert(key_of(cell_of(point_world)));
}

bool SurveyedPlaces::has(const Vector3d& point_world) const {
  if (!is_in_reach(point_world)) return false;
  const Cell middle = cell_of(point_world);
  for (std::int64_t i = 0; i < 27; ++i) {
    const Cell near = {middle[0] + i % 3 - 1, middle[1] + i / 3 % 3 - 1, middle[2] + i / 9 - 1};
    if (cells_.contains(key_of(near))) return true;
  }
  return false;
}

SurveyedPlaces places_of(const SurveyOpener& survey) {
  SurveyedPlaces seen;
  const auto reader = cloud_of(survey());
  std::vector<CloudPoint> points;
  while (reader->read(points)) {
    for (const CloudPoint& point : points) seen.add(point.position);
  }
  return seen;
}

}  // namespace pointflight
