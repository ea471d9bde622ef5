#pragma once

#include <optional>
#include <variant>
#include <vector>

#include "pointflight/geometry/types.hpp"

namespace pointflight {

/// What a solid is drawn as by viewers that know these three alone.
enum class PlainShape { kSphere, kBox, kCylinder };

/// Around the origin of its own frame, as all solids here.
struct Sphere {
  static constexpr const char* kName = "sphere";                  ///< For viewers.
  static constexpr PlainShape kPlainShape = PlainShape::kSphere;  ///< Exactly.
  double radius = 0.0;                                            ///< m
};
/// A box along its own axes.
struct Box {
  static constexpr const char* kName = "box";                  ///< For viewers.
  static constexpr PlainShape kPlainShape = PlainShape::kBox;  ///< Exactly.
  Vector3d half = Vector3d::Zero();                            ///< Half sides, m.
};
/// Upright, with flat ends.
struct Cylinder {
  static constexpr const char* kName = "cylinder";                  ///< For viewers.
  static constexpr PlainShape kPlainShape = PlainShape::kCylinder;  ///< Exactly.
  double radius = 0.0;                                              ///< m
  double half_height = 0.0;                                         ///< Along z, m.
};
/// All points within `radius` of a segment along z.
struct Capsule {
  static constexpr const char* kName = "capsule";                   ///< For viewers.
  static constexpr PlainShape kPlainShape = PlainShape::kCylinder;  ///< The one around it.
  double radius = 0.0;                                              ///< m
  double half_length = 0.0;  ///< Of the segment, without the caps, m.
};
/// Convex solids around the origin of their own frame: hulls of vehicles and obstacles.
using Solid = std::variant<Sphere, Box, Cylinder, Capsule>;

/// Where a ray enters a solid.
struct SolidHit {
  double range;     ///< m
  Vector3d normal;  ///< Outward unit normal, the solid's frame.
};

/// First intersection of a ray (the solid's frame, unit `direction`) with the solid's surface. A
/// ray that starts inside hits nothing: a sensor does not see the hull it sits in.
std::optional<SolidHit> intersect(const Solid& solid,
                                  const Vector3d& origin,
                                  const Vector3d& direction);

/// The name and outline of a solid's kind.
///@{
const char* name_of(const Solid& solid);
PlainShape plain_shape_of(const Solid& solid);
///@}

/// The farthest point of the solid from its origin, m.
double bounding_radius(const Solid& solid);

/// Half sides of the smallest box along the solid's own axes.
Vector3d half_extent(const Solid& solid);

/// How far two solids are apart.
struct Separation {
  /// m; if they overlap, minus the shortest way that takes them apart (with a cylinder against
  /// anything but a ball: at most a little longer than the shortest).
  double distance;
  Vector3d point;  ///< A point of the second solid nearest to the first one.
};

/// Distance between solids a and b at their poses: closed form if one is a ball, else the
/// algorithm of Gilbert, Johnson and Keerthi (1988) between their cores; to 1e-9 m.
Separation separation(const Solid& a, const Pose& T_world_a, const Solid& b, const Pose& T_world_b);

/// Signed distance of a point (the solid's frame) to the solid's surface: negative inside.
double signed_distance(const Solid& solid, const Vector3d& point);

/// Point of the surface of a solid for (u, v) in [0, 1)^2, uniform by area.
Vector3d surface_point(const Solid& solid, double u, double v);

/// m^2
double surface_area(const Solid& solid);

/// Points all over the surface, about `spacing` (m) apart.
std::vector<Vector3d> surface_points(const Solid& solid, double spacing);

}  // namespace pointflight
