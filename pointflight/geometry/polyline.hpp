// Ways of straight legs.
#pragma once

#include <cstddef>
#include <vector>

#include "pointflight/geometry/types.hpp"

namespace pointflight {

/// m, of all legs.
inline double length_of(const std::vector<Vector3d>& way) {
  double length = 0.0;
  for (std::size_t i = 1; i < way.size(); ++i) length += (way[i] - way[i - 1]).norm();
  return length;
}

/// Leaves out corners between which a straight leg is free: `is_free(from, to)` for two corners, by
/// number. From each corner to one as far ahead as steps find that are halved where they fail. At
/// least one corner.
template <class IsFree>
std::vector<Vector3d> with_fewer_corners(const std::vector<Vector3d>& way, const IsFree& is_free) {
  std::vector<Vector3d> kept = {way.front()};
  for (std::size_t at = 0; at + 1 < way.size();) {
    std::size_t reach = at + 1;
    for (std::size_t step = way.size() - 1 - at; step > 0; step /= 2) {
      while (reach + step < way.size() && is_free(at, reach + step)) reach += step;
    }
    kept.push_back(way[reach]);
    at = reach;
  }
  return kept;
}

}  // namespace pointflight
