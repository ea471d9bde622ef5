// Distances between solids. A ball or capsule is a core (a point, a segment) with a radius around
// it; distances are taken between cores.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "pointflight/geometry/internal/solid_core.hpp"

namespace pointflight {
namespace {

/// The core's farthest point along a direction.
Vector3d support(const SolidCore& core, const Vector3d& d) {
  Vector3d p(std::copysign(core.half.x(), d.x()),
             std::copysign(core.half.y(), d.y()),
             std::copysign(core.half.z(), d.z()));
  const double across = std::hypot(d.x(), d.y());
  if (core.tube > 0.0 && across > 0.0) {
    p.x() = core.tube * d.x() / across;
    p.y() = core.tube * d.y() / across;
  }
  return p;
}

/// How far the core reaches from its centre along a unit direction.
double extent(const SolidCore& core, const Vector3d& n) {
  return core.half.dot(n.cwiseAbs()) + core.tube * std::hypot(n.x(), n.y());
}

/// The core's point nearest to a point.
Vector3d nearest_point(const SolidCore& core, const Vector3d& p) {
  Vector3d q = p.cwiseMin(core.half).cwiseMax(-core.half);
  if (core.tube > 0.0) {
    const double across = std::hypot(p.x(), p.y());
    const double scale = across > core.tube ? core.tube / across : 1.0;
    q.x() = p.x() * scale;
    q.y() = p.y() * scale;
  }
  return q;
}

/// A corner of the difference of two cores, with the points that make it.
struct Corner {
  Vector3d w;  ///< a - b
  Vector3d a, b;
  double share = 0.0;  ///< In the simplex' point nearest to the origin.
};

/// The corners that span the point nearest to the origin so far.
struct Simplex {
  std::array<Corner, 4> corners;
  int count = 0;

  [[nodiscard]] Vector3d point() const { return mix(&Corner::w); }
  [[nodiscard]] Vector3d mix(Vector3d Corner::*member) const {
    Vector3d sum = Vector3d::Zero();
    for (int i = 0; i < count; ++i) sum += corners[i].share * (corners[i].*member);
    return sum;
  }
};

Simplex of(std::initializer_list<const Corner*> corners, std::initializer_list<double> shares) {
  Simplex s;
  auto share = shares.begin();
  for (const Corner* corner : corners) {
    s.corners[s.count] = *corner;
    s.corners[s.count++].share = *share++;
  }
  return s;
}

/// Point of a segment nearest to the origin.
Simplex reduced(const Corner& a, const Corner& b) {
  const Vector3d ab = b.w - a.w;
  const double t = -a.w.dot(ab);
  const double length = ab.squaredNorm();
  if (t <= 0.0) return of({&a}, {1.0});
  if (t >= length) return of({&b}, {1.0});
  return of({&a, &b}, {1.0 - t / length, t / length});
}

Simplex nearer(const Simplex& a, const Simplex& b) {
  return b.point().squaredNorm() < a.point().squaredNorm() ? b : a;
}

/// Point of a triangle nearest to the origin. All edges are looked at, and not only those on the
/// origin's side: of thin triangles rounding makes any side.
Simplex reduced(const Corner& a, const Corner& b, const Corner& c) {
  Simplex best = nearer(nearer(reduced(a, b), reduced(b, c)), reduced(c, a));
  const Vector3d ab = b.w - a.w;
  const Vector3d ac = c.w - a.w;
  const Vector3d normal = ab.cross(ac);
  const double area = normal.squaredNorm();
  if (area <= 0.0) return best;
  // barycentric coordinates of the origin's projection
  const double share_b = normal.dot(ac.cross(a.w)) / area;
  const double share_c = normal.dot(a.w.cross(ab)) / area;
  const double share_a = 1.0 - share_b - share_c;
  if (share_a < 0.0 || share_b < 0.0 || share_c < 0.0) return best;
  return nearer(best, of({&a, &b, &c}, {share_a, share_b, share_c}));
}

/// Twice the area of a triangle, as its normal.
Vector3d normal_of(const Corner& p, const Corner& q, const Corner& r) {
  return (q.w - p.w).cross(r.w - p.w);
}

/// Point of a tetrahedron nearest to the origin; four corners if it lies inside.
Simplex reduced(const Corner& a, const Corner& b, const Corner& c, const Corner& d) {
  const Simplex best = nearer(nearer(reduced(a, b, c), reduced(a, c, d)),
                              nearer(reduced(a, d, b), reduced(b, d, c)));
  // the origin is on the inner side of each face
  double twice_area = 0.0;
  double six_volumes = 0.0;
  const std::array<std::array<const Corner*, 4>, 4> faces = {
      std::array<const Corner*, 4>{&a, &b, &c, &d},
      std::array<const Corner*, 4>{&a, &c, &d, &b},
      std::array<const Corner*, 4>{&a, &d, &b, &c},
      std::array<const Corner*, 4>{&b, &d, &c, &a}};
  for (const auto& [p, q, r, opposite] : faces) {
    const Vector3d normal = normal_of(*p, *q, *r);
    const double height = (opposite->w - p->w).dot(normal);
    if (!(-p->w.dot(normal) * height > 0.0)) return best;
    twice_area += normal.norm();
    six_volumes = std::abs(height);
  }
  // of flat ones rounding makes any side; but nothing inside is farther from all faces than the
  // inscribed ball's centre
  if (best.point().norm() * twice_area > 1.001 * six_volumes) return best;
  return of({&a, &b, &c, &d}, {0.25, 0.25, 0.25, 0.25});
}

Simplex reduced(const Simplex& s) {
  const auto& c = s.corners;
  switch (s.count) {
    case 1:
      return of({&c[0]}, {1.0});
    case 2:
      return reduced(c[0], c[1]);
    case 3:
      return reduced(c[0], c[1], c[2]);
    default:
      return reduced(c[0], c[1], c[2], c[3]);
  }
}

/// Nearest points of two cores, in the frame of the first; nothing if they overlap.
struct NearestPair {
  Vector3d a, b;
};
std::optional<NearestPair> nearest_pair(const SolidCore& a, const SolidCore& b, const Pose& T_a_b) {
  constexpr int kIterations = 128;
  constexpr double kTouching = 1e-12;  // m
  constexpr double kRelative = 1e-13;
  const Quaterniond q_b_a = T_a_b.rotation.conjugate();
  const auto corner = [&](const Vector3d& direction) {
    Corner c;
    c.a = support(a, direction);
    c.b = T_a_b * support(b, q_b_a * -direction);
    c.w = c.a - c.b;
    return c;
  };
  Simplex simplex;
  simplex.corners[0] = corner(T_a_b.translation);
  simplex.count = 1;
  simplex = reduced(simplex);
  for (int i = 0; i < kIterations; ++i) {
    const Vector3d v = simplex.point();
    const double squared = v.squaredNorm();
    if (squared < kTouching * kTouching) return std::nullopt;
    const Corner next = corner(-v);
    if (squared - v.dot(next.w) <= kRelative * squared) break;
    Simplex larger = simplex;
    larger.corners[larger.count++] = next;
    larger = reduced(larger);
    if (larger.count == 4) return std::nullopt;
    if (larger.point().squaredNorm() >= squared) break;  // rounding: no nearer any more
    simplex = larger;
  }
  return NearestPair{simplex.mix(&Corner::a), simplex.mix(&Corner::b)};
}

/// The shortest way that takes two overlapping cores apart: the least overlap over the directions
/// in which faces or pairs of edges can meet (separating axes; exact for cuboids and segments).
struct Overlap {
  double depth = std::numeric_limits<double>::infinity();
  Vector3d direction = Vector3d::UnitZ();  ///< From a towards b, the frame of a.
};
Overlap overlap(const SolidCore& a, const SolidCore& b, const Pose& T_a_b) {
  Overlap least;
  const Matrix3d turn = T_a_b.rotation.toRotationMatrix();
  const Vector3d& offset = T_a_b.translation;
  const auto look = [&](const Vector3d& axis) {
    const double length = axis.norm();
    if (length < 1e-9) return;
    const Vector3d n = axis / length;
    const double along = n.dot(offset);
    const double depth = extent(a, n) + extent(b, turn.transpose() * n) - std::abs(along);
    if (depth >= least.depth) return;
    least = {depth, along < 0.0 ? Vector3d(-n) : n};
  };
  for (int i = 0; i < 3; ++i) {
    look(Vector3d::Unit(i));
    look(turn.col(i));
    for (int j = 0; j < 3; ++j) look(Vector3d::Unit(i).cross(turn.col(j)));
  }
  // across a cylinder every direction is a face's
  look(Vector3d(offset.x(), offset.y(), 0.0));
  look(offset - turn.col(2) * turn.col(2).dot(offset));
  return least;
}

/// Of a ball around the origin of `center`'s frame to a core.
Separation ball_to_core(const Vector3d& center,
                        double radius,
                        const SolidCore& core,
                        const Solid& b) {
  const double distance = signed_distance(b, center) - radius;
  const Vector3d on_core = nearest_point(core, center);
  const Vector3d way = center - on_core;
  const double length = way.norm();
  const Vector3d place =
      length > 0.0 ? Vector3d(on_core + way * (std::min(core.radius, length) / length)) : on_core;
  return {distance, place};
}

}  // namespace

Separation separation(const Solid& a,
                      const Pose& T_world_a,
                      const Solid& b,
                      const Pose& T_world_b) {
  const SolidCore core_a = core_of(a);
  const SolidCore core_b = core_of(b);
  if (std::holds_alternative<Sphere>(a)) {
    const Vector3d center = T_world_b.inverse() * T_world_a.translation;
    Separation s = ball_to_core(center, core_a.radius, core_b, b);
    s.point = T_world_b * s.point;
    return s;
  }
  const Pose T_a_b = T_world_a.inverse() * T_world_b;
  if (std::holds_alternative<Sphere>(b)) {
    // the point of the ball that is nearest to (or deepest in) the other
    const Vector3d& center = T_a_b.translation;
    const double distance = signed_distance(a, center) - core_b.radius;
    const Vector3d way = nearest_point(core_a, center) - center;
    const double length = way.norm();
    const double step = std::min(core_b.radius, length);
    const Vector3d place = length > 0.0 ? Vector3d(center + way * (step / length)) : center;
    return {distance, T_world_a * place};
  }
  const double radii = core_a.radius + core_b.radius;
  if (const auto pair = nearest_pair(core_a, core_b, T_a_b)) {
    const Vector3d way = pair->a - pair->b;
    const double length = way.norm();
    const Vector3d place = pair->b + way * (std::min(core_b.radius, length) / length);
    return {length - radii, T_world_a * place};
  }
  const Overlap o = overlap(core_a, core_b, T_a_b);
  const Vector3d deepest =
      T_a_b * support(core_b, T_a_b.rotation.conjugate() * Vector3d(-o.direction));
  return {-std::max(0.0, o.depth) - radii,
          T_world_a * Vector3d(deepest - core_b.radius * o.direction)};
}

}  // namespace pointflight
