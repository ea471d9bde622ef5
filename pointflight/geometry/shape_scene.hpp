#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <variant>
#include <vector>

#include "pointflight/geometry/types.hpp"

namespace pointflight {

/// Two-sided.
struct Triangle {
  Vector3d a;  ///< m, as the other corners.
  Vector3d b;  ///< In either sense of turning.
  Vector3d c;  ///< Not on the line through a and b.
};
/// The mantle of a cone or, with equal radii, of a cylinder: no caps.
struct Cone {
  Vector3d from;       ///< One end of the axis, m.
  Vector3d to;         ///< The other end, m.
  double radius_from;  ///< m
  double radius_to;    ///< m
};
/// Two-sided.
struct Disc {
  Vector3d center;  ///< m
  Vector3d normal;  ///< Unit vector, of either side.
  double radius;    ///< m
};
/// The surface of a ball; rays that start inside hit it too.
struct SceneSphere {
  Vector3d center;  ///< m
  double radius;    ///< m
};

/// Shapes with exact ranges: what tests and generated maps are made of.
using Shape = std::variant<Triangle, Cone, Disc, SceneSphere>;

/// Distance along the unit `direction` to the first intersection with the shape beyond `t_min`, if
/// any.
std::optional<double> intersect(const Shape& shape,
                                const Vector3d& origin,
                                const Vector3d& direction,
                                double t_min = 1e-9);

/// Surface area, m^2 (a cone's mantle, both radii included).
double area(const Shape& shape);

/// Point of the surface for (u, v) in [0, 1)^2, uniform by area.
Vector3d point_on(const Shape& shape, double u, double v);

/// Unit normal of the surface at a point of it (of a cone: across its axis); the side is arbitrary.
Vector3d normal_at(const Shape& shape, const Vector3d& point);

/// Axis-aligned box around the shape.
Aabb bounds(const Shape& shape);

/// Calls `emit(point)` for the draws [first, first + count) of shape number `index`: points uniform
/// by area, each moved along its normal by `noise` * N(0, 1). Every draw is addressed by (seed,
/// index, number), so parts may be drawn apart.
void sample_shape(const Shape& shape,
                  std::uint32_t index,
                  std::uint64_t first,
                  std::uint64_t count,
                  double noise,
                  std::uint64_t seed,
                  const std::function<void(const Vector3d&)>& emit);

/// A list of shapes with exact ray casting by brute force.
struct ShapeScene {
  std::vector<Shape> shapes;  ///< In the order of their numbers.

  /// First intersection of the ray with any shape.
  [[nodiscard]] std::optional<double> intersect(const Vector3d& origin,
                                                const Vector3d& direction) const;

  /// Calls `emit(point)` for points drawn uniformly by area, `density` a square metre, each moved
  /// along its surface normal by `noise` * N(0, 1). Deterministic in `seed`.
  void sample(double density,
              double noise,
              std::uint64_t seed,
              const std::function<void(const Vector3d&)>& emit) const;

  /// From `corner` along both edges, m, as two triangles.
  void add_rectangle(const Vector3d& corner, const Vector3d& edge_u, const Vector3d& edge_v);
  /// Twelve triangles between two opposite corners, m.
  void add_box(const Vector3d& min, const Vector3d& max);
};

/// Parameters of a made-up forest: relief ground, tapered trunks, branches and leaves.
struct ForestOptions {
  double size_x = 60.0;              ///< m
  double size_y = 60.0;              ///< m
  double trees_per_hectare = 600.0;  ///< Fewer if the spacing leaves no room.
  double trunk_radius_min = 0.08;    ///< At the foot, m.
  double trunk_radius_max = 0.25;    ///< At the foot, m.
  double height_min = 6.0;           ///< Of a trunk, m.
  double height_max = 14.0;          ///< Of a trunk, m.
  double min_spacing = 2.0;          ///< Least distance between trunks, m.
  std::uint64_t seed = 1;            ///< Of positions, sizes and branches.
};

/// A forest from x, y = 0 to (size_x, size_y), ground around z = 0. Deterministic in the options.
ShapeScene make_forest(const ForestOptions& options);

}  // namespace pointflight
