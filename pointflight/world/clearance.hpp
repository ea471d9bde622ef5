#pragma once

#include "pointflight/geometry/types.hpp"
#include "pointflight/map/surfel_map.hpp"

namespace pointflight {

/// Least clearance of a sphere of `radius` that moves from a to b in a straight line, at most
/// `reach`; never above the true value by more than a millimetre.
double clearance_along(const SurfelMap& map,
                       const Vector3d& a_world,
                       const Vector3d& b_world,
                       double radius,
                       double reach);

}  // namespace pointflight
