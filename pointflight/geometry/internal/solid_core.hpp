#pragma once

#include "pointflight/geometry/solid.hpp"

namespace pointflight {

/// A solid as a core (a point, segment, box or upright disc or tube) with a radius around it:
/// distances are taken between cores. All are symmetric about their centres, so that one extent
/// serves both directions.
struct SolidCore {
  Vector3d half = Vector3d::Zero();  ///< Of a box; zero sides make segments and points.
  double tube = 0.0;                 ///< Radius of a cylinder along z with half height half.z().
  double radius = 0.0;               ///< Around the core.
};
SolidCore core_of(const Solid& solid);

}  // namespace pointflight
