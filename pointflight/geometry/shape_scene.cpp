#include "pointflight/geometry/shape_scene.hpp"

#include <algorithm>
#include <cmath>

#include "pointflight/core/constants.hpp"
#include "pointflight/core/math.hpp"
#include "pointflight/core/random.hpp"

namespace pointflight {
namespace {

/// Two unit vectors that complete the unit `axis` to a right-handed frame.
std::pair<Vector3d, Vector3d> frame_around(const Vector3d& axis) {
  const Vector3d helper = std::abs(axis.z()) < 0.9 ? Vector3d::UnitZ() : Vector3d::UnitX();
  const Vector3d u = axis.cross(helper).normalized();
  return {u, axis.cross(u)};
}

// Moeller and Trumbore 1997
std::optional<double> hit(const Triangle& tri, const Vector3d& o, const Vector3d& d, double t_min) {
  const Vector3d e1 = tri.b - tri.a;
  const Vector3d e2 = tri.c - tri.a;
  const Vector3d p = d.cross(e2);
  const double det = e1.dot(p);
  if (std::abs(det) < 1e-15) return std::nullopt;
  const Vector3d s = o - tri.a;
  const double u = s.dot(p) / det;
  if (u < 0.0 || u > 1.0) return std::nullopt;
  const Vector3d q = s.cross(e1);
  const double v = d.dot(q) / det;
  if (v < 0.0 || u + v > 1.0) return std::nullopt;
  const double t = e2.dot(q) / det;
  if (t <= t_min) return std::nullopt;
  return t;
}

std::optional<double> hit(const Disc& disc, const Vector3d& o, const Vector3d& d, double t_min) {
  const double slope = d.dot(disc.normal);
  if (std::abs(slope) < 1e-12) return std::nullopt;
  const double t = (disc.center - o).dot(disc.normal) / slope;
  if (t <= t_min || (o + t * d - disc.center).norm() > disc.radius) return std::nullopt;
  return t;
}

/// The smaller root of a t^2 + 2 b t + c = 0 beyond t_min that `accept` takes.
template <class Accept>
std::optional<double> first_root(double a, double b, double c, double t_min, const Accept& accept) {
  const double discriminant = b * b - a * c;
  if (discriminant < 0.0 || std::abs(a) < 1e-15) return std::nullopt;
  const double root = std::sqrt(discriminant);
  double low = (-b - root) / a;
  double high = (-b + root) / a;
  if (low > high) std::swap(low, high);
  if (low > t_min && accept(low)) return low;
  if (high > t_min && accept(high)) return high;
  return std::nullopt;
}

std::optional<double> hit(const SceneSphere& s,
                          const Vector3d& o,
                          const Vector3d& d,
                          double t_min) {
  const Vector3d m = o - s.center;
  const auto anywhere = [](double) { return true; };
  return first_root(1.0, m.dot(d), m.squaredNorm() - s.radius * s.radius, t_min, anywhere);
}

// |p - axis point|^2 = (r0 + k h)^2 with h the height along the axis
std::optional<double> hit(const Cone& cone, const Vector3d& o, const Vector3d& d, double t_min) {
  const Vector3d span = cone.to - cone.from;
  const double length = span.norm();
  const Vector3d axis = span / length;
  const double k = (cone.radius_to - cone.radius_from) / length;
  const Vector3d m = o - cone.from;
  const double mh = m.dot(axis);
  const double dh = d.dot(axis);
  const Vector3d m_side = m - mh * axis;
  const Vector3d d_side = d - dh * axis;
  const double r = cone.radius_from + k * mh;
  const auto within = [&](double t) {
    const double h = mh + t * dh;
    return h >= 0.0 && h <= length;
  };
  return first_root(d_side.squaredNorm() - k * k * dh * dh,
                    m_side.dot(d_side) - r * k * dh,
                    m_side.squaredNorm() - r * r,
                    t_min,
                    within);
}

double area_of(const Triangle& t) {
  return 0.5 * (t.b - t.a).cross(t.c - t.a).norm();
}
double area_of(const Disc& d) {
  return kPi * d.radius * d.radius;
}
double area_of(const SceneSphere& s) {
  return 4.0 * kPi * s.radius * s.radius;
}
double area_of(const Cone& c) {
  const double slant = std::hypot((c.to - c.from).norm(), c.radius_to - c.radius_from);
  return kPi * (c.radius_from + c.radius_to) * slant;
}

Vector3d point_of(const Triangle& t, double u, double v) {
  const double root = std::sqrt(u);
  return t.a + root * (1.0 - v) * (t.b - t.a) + root * v * (t.c - t.a);
}
Vector3d point_of(const Disc& disc, double u, double v) {
  const auto [e1, e2] = frame_around(disc.normal);
  const auto angle = math::sincos(2.0 * kPi * v);
  return disc.center + disc.radius * std::sqrt(u) * (angle.cos * e1 + angle.sin * e2);
}
Vector3d point_of(const SceneSphere& s, double u, double v) {
  const double z = 1.0 - 2.0 * u;
  const double ring = std::sqrt(std::max(0.0, 1.0 - z * z));
  const auto angle = math::sincos(2.0 * kPi * v);
  return s.center + s.radius * Vector3d(ring * angle.cos, ring * angle.sin, z);
}
Vector3d point_of(const Cone& cone, double u, double v) {
  const Vector3d span = cone.to - cone.from;
  const auto [e1, e2] = frame_around(span.normalized());
  // the density along the axis grows with the radius: invert its integral
  const double r0 = cone.radius_from;
  const double r1 = cone.radius_to;
  const double share = std::abs(r1 - r0) < 1e-12 * (r0 + r1)
                           ? u
                           : (std::sqrt(r0 * r0 + u * (r1 * r1 - r0 * r0)) - r0) / (r1 - r0);
  const auto angle = math::sincos(2.0 * kPi * v);
  const double radius = r0 + share * (r1 - r0);
  return cone.from + share * span + radius * (angle.cos * e1 + angle.sin * e2);
}

Vector3d normal_of(const Triangle& t, const Vector3d& /*p*/) {
  return (t.b - t.a).cross(t.c - t.a).normalized();
}
Vector3d normal_of(const Disc& d, const Vector3d& /*p*/) {
  return d.normal;
}
Vector3d normal_of(const SceneSphere& s, const Vector3d& p) {
  return (p - s.center).normalized();
}
Vector3d normal_of(const Cone& c, const Vector3d& p) {
  const Vector3d axis = (c.to - c.from).normalized();
  const Vector3d m = p - c.from;
  return (m - m.dot(axis) * axis).normalized();
}

Aabb box_around(const Vector3d& center, const Vector3d& axis, double radius) {
  // a circle reaches radius * sin(angle between its axis and the coordinate's) to each side
  const Vector3d half = radius * (Vector3d::Ones() - axis.cwiseAbs2()).cwiseMax(0.0).cwiseSqrt();
  Aabb box;
  box.add(center - half);
  box.add(center + half);
  return box;
}

Aabb bounds_of(const Triangle& t) {
  Aabb box;
  box.add(t.a);
  box.add(t.b);
  box.add(t.c);
  return box;
}
Aabb bounds_of(const Disc& d) {
  return box_around(d.center, d.normal, d.radius);
}
Aabb bounds_of(const SceneSphere& s) {
  Aabb box;
  box.add(s.center - Vector3d::Constant(s.radius));
  box.add(s.center + Vector3d::Constant(s.radius));
  return box;
}
Aabb bounds_of(const Cone& c) {
  const Vector3d axis = (c.to - c.from).normalized();
  Aabb box = box_around(c.from, axis, c.radius_from);
  const Aabb end = box_around(c.to, axis, c.radius_to);
  box.add(end.min);
  box.add(end.max);
  return box;
}

}  // namespace

std::optional<double> intersect(const Shape& shape,
                                const Vector3d& origin,
                                const Vector3d& direction,
                                double t_min) {
  return std::visit([&](const auto& s) { return hit(s, origin, direction, t_min); }, shape);
}

double area(const Shape& shape) {
  return std::visit([](const auto& s) { return area_of(s); }, shape);
}

Vector3d point_on(const Shape& shape, double u, double v) {
  return std::visit([&](const auto& s) { return point_of(s, u, v); }, shape);
}

Vector3d normal_at(const Shape& shape, const Vector3d& point) {
  return std::visit([&](const auto& s) { return normal_of(s, point); }, shape);
}

Aabb bounds(const Shape& shape) {
  return std::visit([](const auto& s) { return bounds_of(s); }, shape);
}

void sample_shape(const Shape& shape,
                  std::uint32_t index,
                  std::uint64_t first,
                  std::uint64_t count,
                  double noise,
                  std::uint64_t seed,
                  const std::function<void(const Vector3d&)>& emit) {
  const RandomStream random(seed, StreamId::kCloudSampling, index);
  for (std::uint64_t k = first; k < first + count; ++k) {
    const auto [u, v] = random.uniform2(2 * k);
    Vector3d p = point_on(shape, u, v);
    if (noise > 0.0) p += noise * random.normal(2 * k + 1) * normal_at(shape, p);
    emit(p);
  }
}

std::optional<double> ShapeScene::intersect(const Vector3d& origin,
                                            const Vector3d& direction) const {
  std::optional<double> nearest;
  for (const Shape& shape : shapes) {
    const auto t = pointflight::intersect(shape, origin, direction);
    if (t && (!nearest || *t < *nearest)) nearest = t;
  }
  return nearest;
}

void ShapeScene::sample(double density,
                        double noise,
                        std::uint64_t seed,
                        const std::function<void(const Vector3d&)>& emit) const {
  double owed = 0.0;  // carried over, so that many small shapes get their share
  for (std::size_t i = 0; i < shapes.size(); ++i) {
    owed += area(shapes[i]) * density;
    const auto count = static_cast<std::uint64_t>(owed);
    owed -= static_cast<double>(count);
    sample_shape(shapes[i], static_cast<std::uint32_t>(i), 0, count, noise, seed, emit);
  }
}

void ShapeScene::add_rectangle(const Vector3d& corner,
                               const Vector3d& edge_u,
                               const Vector3d& edge_v) {
  const Vector3d far_corner = corner + edge_u + edge_v;
  shapes.emplace_back(Triangle{corner, corner + edge_u, far_corner});
  shapes.emplace_back(Triangle{corner, far_corner, corner + edge_v});
}

void ShapeScene::add_box(const Vector3d& min, const Vector3d& max) {
  const Vector3d x((max - min).x(), 0, 0);
  const Vector3d y(0, (max - min).y(), 0);
  const Vector3d z(0, 0, (max - min).z());
  for (const auto& [corner, u, v] : {std::array<Vector3d, 3>{min, x, y},
                                     {min, x, z},
                                     {min, y, z},
                                     {min + z, x, y},
                                     {min + y, x, z},
                                     {min + x, y, z}}) {
    add_rectangle(corner, u, v);
  }
}

}  // namespace pointflight
