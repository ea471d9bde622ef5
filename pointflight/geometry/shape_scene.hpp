#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <variant>
#include <vector>

#include "pointflight/geometry/types.hpp"

namespace pointflight {

struct Triangle {
  Vector3d a, b, c;  ///< Two-sided.
};
struct Cone {
  Vector3d from, to;              ///< Axis.
  double radius_from, radius_to;  ///< No caps; equal radii make a cylinder.
};
struct Disc {
  Vector3d center, normal;
  double radius;  ///< Two-sided.
};
struct Sphere {
  Vector3d center;
  double radius;
};

/// Shapes with exact ranges: what tests and generated maps are made of.
using Shape = std::variant<Triangle, Cone, Disc, Sphere>;

/// Distance along the unit `direction` to the first meeting with the shape beyond `t_min`, if any.
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
  std::vector<Shape> shapes;

  /// First meeting of the ray with any shape.
  [[nodiscard]] std::optional<double> intersect(const Vector3d& origin,
                                                const Vector3d& direction) const;

  /// Calls `emit(point)` for points drawn uniformly by area, `density` a square metre, each moved
  /// along its surface normal by `noise` * N(0, 1). Deterministic in `seed`.
  void sample(double density,
              double noise,
              std::uint64_t seed,
              const std::function<void(const Vector3d&)>& emit) const;

  void add_rectangle(const Vector3d& corner, const Vector3d& edge_u, const Vector3d& edge_v);
  void add_box(const Vector3d& min, const Vector3d& max);
};

/// Parameters of a made-up forest: relief ground, tapered trunks, branches and leaves.
struct ForestOptions {
  double size_x = 60.0;  ///< m
  double size_y = 60.0;  ///< m
  double trees_per_hectare = 600.0;
  double trunk_radius_min = 0.08;
  double trunk_radius_max = 0.25;
  double height_min = 6.0;
  double height_max = 14.0;
  double min_spacing = 2.0;  ///< Least distance between trunks, m.
  std::uint64_t seed = 1;
};

/// A forest from x, y = 0 to (size_x, size_y), ground around z = 0. Deterministic in the options.
ShapeScene make_forest(const ForestOptions& options);

}  // namespace pointflight
