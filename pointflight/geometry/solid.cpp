#include "pointflight/geometry/solid.hpp"

#include <algorithm>
#include <cmath>

#include "pointflight/core/constants.hpp"
#include "pointflight/core/math.hpp"
#include "pointflight/geometry/internal/solid_core.hpp"

namespace pointflight {
namespace {

/// Interval of a ray inside something convex, and the normal where it begins.
struct Inside {
  double enter = -std::numeric_limits<double>::infinity();
  double leave = std::numeric_limits<double>::infinity();
  Vector3d normal = Vector3d::Zero();

  void cut(double from, double to, const Vector3d& normal_at_entry) {
    if (from > enter) {
      enter = from;
      normal = normal_at_entry;
    }
    leave = std::min(leave, to);
  }
  void cut_all() { leave = -std::numeric_limits<double>::infinity(); }

  [[nodiscard]] std::optional<SolidHit> first() const {
    if (enter > leave || enter < 0.0) return std::nullopt;
    return SolidHit{enter, normal};
  }
};

/// Between the planes axis = -half and axis = half.
void cut_slab(Inside& inside, int axis, double half, const Vector3d& o, const Vector3d& d) {
  if (d[axis] == 0.0) {
    if (std::abs(o[axis]) > half) inside.cut_all();
    return;
  }
  const double side = d[axis] > 0.0 ? -1.0 : 1.0;  // of the plane that is hit first
  inside.cut((side * half - o[axis]) / d[axis],
             (-side * half - o[axis]) / d[axis],
             side * Vector3d::Unit(axis));
}

/// Roots of a t^2 + 2 b t + c, the lesser first.
std::optional<std::array<double, 2>> roots(double a, double b, double c) {
  const double discriminant = b * b - a * c;
  if (discriminant < 0.0) return std::nullopt;
  const double q = -(b + (b < 0.0 ? -1.0 : 1.0) * std::sqrt(discriminant));
  const double t0 = q / a;
  const double t1 = q != 0.0 ? c / q : t0;
  return std::array<double, 2>{std::min(t0, t1), std::max(t0, t1)};
}

/// Within `radius` of the z axis.
void cut_tube(Inside& inside, double radius, const Vector3d& o, const Vector3d& d) {
  const double a = d.x() * d.x() + d.y() * d.y();
  const double b = o.x() * d.x() + o.y() * d.y();
  const double c = o.x() * o.x() + o.y() * o.y() - radius * radius;
  if (a == 0.0) {
    if (c > 0.0) inside.cut_all();
    return;
  }
  const auto t = roots(a, b, c);
  if (!t) {
    inside.cut_all();
    return;
  }
  const Vector3d at = o + (*t)[0] * d;
  inside.cut((*t)[0], (*t)[1], Vector3d(at.x(), at.y(), 0.0) / radius);
}

std::optional<SolidHit> hit(const Sphere& s, const Vector3d& o, const Vector3d& d) {
  const auto t = roots(1.0, o.dot(d), o.squaredNorm() - s.radius * s.radius);
  if (!t || (*t)[0] < 0.0) return std::nullopt;
  return SolidHit{(*t)[0], (o + (*t)[0] * d) / s.radius};
}

std::optional<SolidHit> hit(const Box& s, const Vector3d& o, const Vector3d& d) {
  Inside inside;
  for (int axis = 0; axis < 3; ++axis) cut_slab(inside, axis, s.half[axis], o, d);
  return inside.first();
}

std::optional<SolidHit> hit(const Cylinder& s, const Vector3d& o, const Vector3d& d) {
  Inside inside;
  cut_slab(inside, 2, s.half_height, o, d);
  cut_tube(inside, s.radius, o, d);
  return inside.first();
}

std::optional<SolidHit> hit(const Capsule& s, const Vector3d& o, const Vector3d& d) {
  // convex: the first of what its parts are entered at
  const Vector3d up(0, 0, s.half_length);
  auto best = hit(Cylinder{s.radius, s.half_length}, o, d);
  for (const Vector3d& center : {up, Vector3d(-up)}) {
    const auto cap = hit(Sphere{s.radius}, o - center, d);
    if (cap && (!best || cap->range < best->range)) best = cap;
  }
  return best;
}

Vector3d on_segment(double half_length, const Vector3d& p) {
  return {0.0, 0.0, std::clamp(p.z(), -half_length, half_length)};
}

double distance_to(const Sphere& s, const Vector3d& p) {
  return p.norm() - s.radius;
}
double distance_to(const Box& s, const Vector3d& p) {
  const Vector3d q = p.cwiseAbs() - s.half;
  return q.cwiseMax(0.0).norm() + std::min(0.0, q.maxCoeff());
}
double distance_to(const Cylinder& s, const Vector3d& p) {
  const double beside = std::hypot(p.x(), p.y()) - s.radius;
  const double above = std::abs(p.z()) - s.half_height;
  return std::hypot(std::max(beside, 0.0), std::max(above, 0.0)) +
         std::min(0.0, std::max(beside, above));
}
double distance_to(const Capsule& s, const Vector3d& p) {
  return (p - on_segment(s.half_length, p)).norm() - s.radius;
}

Vector3d extent_of(const Sphere& s) {
  return Vector3d::Constant(s.radius);
}
Vector3d extent_of(const Box& s) {
  return s.half;
}
Vector3d extent_of(const Cylinder& s) {
  return {s.radius, s.radius, s.half_height};
}
Vector3d extent_of(const Capsule& s) {
  return {s.radius, s.radius, s.half_length + s.radius};
}

double reach_of(const Sphere& s) {
  return s.radius;
}
double reach_of(const Box& s) {
  return s.half.norm();
}
double reach_of(const Cylinder& s) {
  return std::hypot(s.radius, s.half_height);
}
double reach_of(const Capsule& s) {
  return s.radius + s.half_length;
}

double area_of(const Sphere& s) {
  return 4.0 * kPi * s.radius * s.radius;
}
double area_of(const Box& s) {
  return 8.0 * (s.half.x() * s.half.y() + s.half.y() * s.half.z() + s.half.z() * s.half.x());
}
double area_of(const Cylinder& s) {
  return 2.0 * kPi * s.radius * (s.radius + 2.0 * s.half_height);
}
double area_of(const Capsule& s) {
  return 4.0 * kPi * s.radius * (s.radius + s.half_length);
}

SolidCore core(const Sphere& s) {
  return {Vector3d::Zero(), 0.0, s.radius};
}
SolidCore core(const Box& s) {
  return {s.half, 0.0, 0.0};
}
SolidCore core(const Cylinder& s) {
  return {Vector3d(0, 0, s.half_height), s.radius, 0.0};
}
SolidCore core(const Capsule& s) {
  return {Vector3d(0, 0, s.half_length), 0.0, s.radius};
}

/// Unit circle at a fraction of the turn.
Vector3d around(double turn) {
  const auto angle = math::sincos(2.0 * kPi * turn);
  return {angle.cos, angle.sin, 0.0};
}

Vector3d point_of(const Sphere& s, double u, double v) {
  const double z = 2.0 * u - 1.0;  // Archimedes: zones of equal height are equal
  return s.radius * (std::sqrt(std::max(0.0, 1.0 - z * z)) * around(v) + Vector3d(0.0, 0.0, z));
}

Vector3d point_of(const Box& s, double u, double v) {
  // the pairs of faces across x, y, z in turn; u is used up to choose one
  const Vector3d& h = s.half;
  const Vector3d areas(h.y() * h.z(), h.z() * h.x(), h.x() * h.y());
  double left = u * areas.sum();
  int axis = 0;
  while (axis < 2 && left >= areas[axis]) left -= areas[axis++];
  double within = areas[axis] > 0.0 ? left / areas[axis] : 0.0;
  const double side = within < 0.5 ? -1.0 : 1.0;
  within = 2.0 * within - (side > 0.0 ? 1.0 : 0.0);
  Vector3d p;
  p[axis] = side * h[axis];
  p[(axis + 1) % 3] = (2.0 * within - 1.0) * h[(axis + 1) % 3];
  p[(axis + 2) % 3] = (2.0 * v - 1.0) * h[(axis + 2) % 3];
  return p;
}

Vector3d point_of(const Cylinder& s, double u, double v) {
  const double cap = kPi * s.radius * s.radius;
  const double left = u * area_of(s);
  if (left < 2.0 * cap) {
    const bool top = left >= cap;
    const double share = (left - (top ? cap : 0.0)) / cap;
    return s.radius * std::sqrt(share) * around(v) +
           Vector3d(0, 0, top ? s.half_height : -s.half_height);
  }
  const double share = (left - 2.0 * cap) / (area_of(s) - 2.0 * cap);
  return s.radius * around(v) + Vector3d(0, 0, (2.0 * share - 1.0) * s.half_height);
}

Vector3d point_of(const Capsule& s, double u, double v) {
  // by height, as on a ball: the tube's mantle has the same area a height as the caps
  const double half = s.half_length + s.radius;
  const double z = (2.0 * u - 1.0) * half;
  const double beyond = std::abs(z) - s.half_length;
  const double radius =
      beyond <= 0.0 ? s.radius : std::sqrt(std::max(0.0, s.radius * s.radius - beyond * beyond));
  return radius * around(v) + Vector3d(0, 0, z);
}

}  // namespace

std::optional<SolidHit> intersect(const Solid& solid,
                                  const Vector3d& origin,
                                  const Vector3d& direction) {
  if (signed_distance(solid, origin) < 0.0) return std::nullopt;
  return std::visit([&](const auto& s) { return hit(s, origin, direction); }, solid);
}

const char* name_of(const Solid& solid) {
  return std::visit([](const auto& s) { return s.kName; }, solid);
}

PlainShape plain_shape_of(const Solid& solid) {
  return std::visit([](const auto& s) { return s.kPlainShape; }, solid);
}

SolidCore core_of(const Solid& solid) {
  return std::visit([](const auto& s) { return core(s); }, solid);
}

double bounding_radius(const Solid& solid) {
  return std::visit([](const auto& s) { return reach_of(s); }, solid);
}

Vector3d half_extent(const Solid& solid) {
  return std::visit([](const auto& s) { return extent_of(s); }, solid);
}

double signed_distance(const Solid& solid, const Vector3d& point) {
  return std::visit([&](const auto& s) { return distance_to(s, point); }, solid);
}

double surface_area(const Solid& solid) {
  return std::visit([](const auto& s) { return area_of(s); }, solid);
}

Vector3d surface_point(const Solid& solid, double u, double v) {
  return std::visit([&](const auto& s) { return point_of(s, u, v); }, solid);
}

std::vector<Vector3d> surface_points(const Solid& solid, double spacing) {
  constexpr double kGolden = 0.6180339887498949;  // spreads v evenly whatever the count
  const auto count = static_cast<std::size_t>(surface_area(solid) / (spacing * spacing)) + 16;
  std::vector<Vector3d> points;
  points.reserve(count);
  for (std::size_t i = 0; i < count; ++i) {
    const auto k = static_cast<double>(i);
    const double v = k * kGolden - std::floor(k * kGolden);
    points.push_back(surface_point(solid, (k + 0.5) / static_cast<double>(count), v));
  }
  return points;
}

}  // namespace pointflight
