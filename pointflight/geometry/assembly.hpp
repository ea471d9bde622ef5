// What several solids make together: a vehicle with arms and propellers.
#pragma once

#include <optional>
#include <vector>

#include "pointflight/core/time.hpp"
#include "pointflight/geometry/solid.hpp"
#include "pointflight/geometry/types.hpp"

namespace pointflight {

/// A solid within an assembly.
struct AssemblyPart {
  Solid solid;           ///< Around the origin of its own frame.
  Pose T_assembly_part;  ///< Where it sits.
};

/// A propeller: flat rectangular blades that turn about an axis along z at a steady speed. A ray
/// hits a blade where it stands at the ray's time, so the disc lets most rays through.
struct Propeller {
  Vector3d center = Vector3d::Zero();  ///< The assembly's frame, m.
  double radius = 0.0;                 ///< Tip of a blade, m.
  double hub_radius = 0.0;             ///< Where blades begin, m.
  double chord = 0.0;                  ///< Width of a blade, m.
  double pitch = 0.0;  ///< Of a blade against the disc, rad: its leading edge is the upper one.
  int blades = 2;      ///< Evenly around.
  double speed = 0.0;  ///< rad/s, counter-clockwise seen from above.
  double phase = 0.0;  ///< Angle of the first blade from x at time zero, rad.
};

/// Solids and propellers that keep their positions in one frame.
struct Assembly {
  std::vector<AssemblyPart> parts;    ///< In any order.
  std::vector<Propeller> propellers;  ///< In any order.
};

/// The first intersection of a ray (in the assembly's frame, unit `direction`) with any part at an
/// instant. A part that the ray starts in is not hit.
std::optional<SolidHit> intersect(const Assembly& assembly,
                                  const Vector3d& origin,
                                  const Vector3d& direction,
                                  SimTime time);

/// No point of the assembly lies farther from its origin, m.
double bounding_radius(const Assembly& assembly);

/// Points all over its surfaces at an instant, about `spacing` (m) apart.
std::vector<Vector3d> surface_points(const Assembly& assembly, double spacing, SimTime time);

}  // namespace pointflight
