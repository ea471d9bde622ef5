#pragma once

#include <array>
#include <memory>
#include <optional>
#include <vector>

#include "pointflight/map/ground_height.hpp"

namespace pointflight {

/// A part of the world: all that is set has to hold.
struct CropRegion {
  std::optional<Aabb> box;                     ///< m
  std::vector<std::array<double, 2>> polygon;  ///< x, y of its corners in order, m; closes itself.
  double above_ground_min = -1e300;            ///< m above `ground`.
  double above_ground_max = 1e300;             ///< m above `ground`.
  std::shared_ptr<const GroundHeight> ground;  ///< Null if heights do not matter.
  bool outside = false;                        ///< All but that part.

  /// True for a point (world, m) that stays.
  [[nodiscard]] bool contains(const Vector3d& point) const;
};

/// True inside a polygon whose corners follow each other (even-odd rule).
bool polygon_contains(const std::vector<std::array<double, 2>>& polygon, double x, double y);

}  // namespace pointflight
