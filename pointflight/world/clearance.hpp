#pragma once

#include <memory>
#include <optional>

#include "pointflight/geometry/types.hpp"
#include "pointflight/map/surfel_map.hpp"

namespace pointflight {

/// What a spherical vehicle is to the map.
struct Clearance {
  double distance;       ///< From the vehicle's sphere to the nearest surfel, m; negative inside.
  Vector3d place_world;  ///< Centre of that surfel.
};

/// Distances from a sphere of `radius` to the map; nothing where all is farther than `reach`.
std::optional<Clearance> clearance(const SurfelMap& map,
                                   const Vector3d& center_world,
                                   double radius,
                                   double reach);

/// Least clearance of a sphere of `radius` that moves from a to b in a straight line, at most
/// `reach`; never above the true value by more than a millimetre.
double clearance_along(const SurfelMap& map,
                       const Vector3d& a_world,
                       const Vector3d& b_world,
                       double radius,
                       double reach);

}  // namespace pointflight
