#include "pointflight/geometry/solid.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "pointflight/core/constants.hpp"
#include "pointflight/core/random.hpp"
#include "pointflight/geometry/rotation.hpp"

namespace pointflight {
namespace {

/// Numbers for a test, drawn in turn.
class Draws {
 public:
  explicit Draws(std::uint32_t test) : random_(7, StreamId::kTest, test) {}
  double uniform(double low, double high) { return random_.uniform(next_++, low, high); }
  Vector3d vector(double reach) {
    return {uniform(-reach, reach), uniform(-reach, reach), uniform(-reach, reach)};
  }
  Vector3d direction() {
    for (;;) {
      const Vector3d v = vector(1.0);
      if (v.norm() > 0.1 && v.norm() < 1.0) return v.normalized();
    }
  }
  Pose pose(double reach) {
    return {quaternion_from_rotation_vector(uniform(0, kPi) * direction()), vector(reach)};
  }
  Solid solid() {
    switch (static_cast<int>(uniform(0, 4))) {
      case 0:
        return Sphere{uniform(0.05, 1)};
      case 1:
        return Box{{uniform(0.002, 1), uniform(0.002, 1), uniform(0.002, 1)}};
      case 2:
        return Cylinder{uniform(0.05, 1), uniform(0.01, 1)};
      default:
        return Capsule{uniform(0.05, 1), uniform(0.01, 1)};
    }
  }

 private:
  RandomStream random_;
  std::uint64_t next_ = 0;
};

/// The point of a solid nearest to a point, by a formulation of its own: a projection.
Vector3d projected(const Solid& solid, const Vector3d& p) {
  struct Visitor {
    const Vector3d& p;
    Vector3d toward(const Vector3d& core, double radius) const {
      const Vector3d way = p - core;
      return way.norm() <= radius ? p : Vector3d(core + radius * way.normalized());
    }
    Vector3d operator()(const Sphere& s) const { return toward(Vector3d::Zero(), s.radius); }
    Vector3d operator()(const Box& s) const { return p.cwiseMin(s.half).cwiseMax(-s.half); }
    Vector3d operator()(const Capsule& s) const {
      return toward({0, 0, std::clamp(p.z(), -s.half_length, s.half_length)}, s.radius);
    }
    Vector3d operator()(const Cylinder& s) const {
      const Vector3d flat = Visitor{Vector3d(p.x(), p.y(), 0)}.toward(Vector3d::Zero(), s.radius);
      return {flat.x(), flat.y(), std::clamp(p.z(), -s.half_height, s.half_height)};
    }
  };
  return std::visit(Visitor{p}, solid);
}

TEST(Solid, RaysMeetTheSurfaceWhereTheSignedDistanceIsZero) {
  Draws draw(1);
  int met = 0;
  for (int i = 0; i < 20000; ++i) {
    SCOPED_TRACE(i);
    const Solid solid = draw.solid();
    const Vector3d origin = draw.vector(3.0);
    const Vector3d direction = (draw.vector(0.7) - origin).normalized();
    const double start = signed_distance(solid, origin);
    const auto hit = intersect(solid, origin, direction);
    // sphere tracing finds the same surface by distances alone
    double t = 0.0;
    double d = start;
    for (int k = 0; k < 2000 && d > 1e-10 && t < 10.0; ++k) {
      t += d;
      d = signed_distance(solid, origin + t * direction);
    }
    if (start < 0.0) {
      EXPECT_FALSE(hit);
      continue;
    }
    if (!hit) {
      EXPECT_GT(d, 0.0);
      continue;
    }
    ++met;
    EXPECT_NEAR(signed_distance(solid, origin + hit->range * direction), 0.0, 1e-12);
    if (d <= 1e-10) {
      EXPECT_NEAR(t, hit->range, 1e-4);  // grazing rays: slow
    }
    EXPECT_NEAR(hit->normal.norm(), 1.0, 1e-9);
    EXPECT_LE(hit->normal.dot(direction), 1e-9);
    // the normal is the distance's gradient, away from edges
    const Vector3d p = origin + hit->range * direction;
    EXPECT_NEAR(signed_distance(solid, p + 1e-6 * hit->normal), 1e-6, 1e-9);
  }
  EXPECT_GT(met, 8000);
}

TEST(Solid, SignedDistanceIsTheDistanceToTheProjection) {
  Draws draw(2);
  for (int i = 0; i < 5000; ++i) {
    const Solid solid = draw.solid();
    const Vector3d p = draw.vector(2.0);
    const double d = signed_distance(solid, p);
    EXPECT_NEAR(std::max(0.0, d), (p - projected(solid, p)).norm(), 1e-12);
    EXPECT_LE(std::abs(d), p.norm() + bounding_radius(solid));
  }
  EXPECT_DOUBLE_EQ(signed_distance(Box{{1, 2, 3}}, {0.5, 0, 0}), -0.5);
  EXPECT_DOUBLE_EQ(signed_distance(Cylinder{1, 3}, {0.25, 0, 0}), -0.75);
  EXPECT_DOUBLE_EQ(signed_distance(Capsule{1, 3}, {0, 0, 3.5}), -0.5);
}

/// Distance of two convex sets by projecting onto one and the other in turn (von Neumann).
double alternating(const Solid& a, const Pose& T_a, const Solid& b, const Pose& T_b) {
  Vector3d p = T_b.translation;
  double last = 1e9;
  for (int i = 0; i < 200000; ++i) {
    const Vector3d q = T_a * projected(a, T_a.inverse() * p);
    p = T_b * projected(b, T_b.inverse() * q);
    const double d = (p - q).norm();
    if (last - d < 1e-16) return d;
    last = d;
  }
  return last;
}

TEST(Separation, IsTheDistanceThatAlternatingProjectionsFind) {
  Draws draw(3);
  double worst = 0.0;
  int apart = 0;
  for (int i = 0; i < 30000; ++i) {
    SCOPED_TRACE(i);
    const Solid a = draw.solid();
    const Solid b = draw.solid();
    const Pose T_a = draw.pose(1.5);
    const Pose T_b = draw.pose(1.5);
    const Separation s = separation(a, T_a, b, T_b);
    const double expected = alternating(a, T_a, b, T_b);
    if (s.distance <= 0.0) {
      EXPECT_LT(expected, 1e-3);  // projections creep up to a touching position
      continue;
    }
    ++apart;
    // they come from above and slowly if faces are nearly parallel
    EXPECT_LE(s.distance, expected + 1e-9);
    EXPECT_GT(s.distance, expected - 2e-4);
    worst = std::max(worst, expected - s.distance);
    // the position lies on b, at that distance from a
    EXPECT_NEAR(signed_distance(b, T_b.inverse() * s.point), 0.0, 1e-7);
    EXPECT_NEAR(signed_distance(a, T_a.inverse() * s.point), s.distance, 1e-7);
    const Separation back = separation(b, T_b, a, T_a);
    EXPECT_NEAR(back.distance, s.distance, 1e-8);
  }
  EXPECT_GT(apart, 10000);
  RecordProperty("worst", std::to_string(worst));
}

TEST(Separation, OverlapIsWhatTakesThemApart) {
  const Pose here;
  const auto at = [](double x) { return Pose{Quaterniond::Identity(), {x, 0, 0}}; };
  EXPECT_NEAR(separation(Sphere{1}, here, Sphere{0.5}, at(1.2)).distance, -0.3, 1e-12);
  EXPECT_NEAR(separation(Box{{1, 1, 1}}, here, Box{{1, 2, 2}}, at(1.9)).distance, -0.1, 1e-12);
  EXPECT_NEAR(separation(Capsule{0.5, 1}, here, Box{{1, 2, 2}}, at(1.2)).distance, -0.3, 1e-12);
  EXPECT_NEAR(separation(Capsule{0.5, 1}, here, Box{{1, 2, 2}}, at(0.9)).distance, -0.6, 1e-12);
  EXPECT_NEAR(separation(Cylinder{0.5, 1}, here, Box{{1, 2, 2}}, at(1.4)).distance, -0.1, 1e-12);
  // after a move of the overlap along the line between the nearest points they just touch
  Draws draw(4);
  for (int i = 0; i < 2000; ++i) {
    SCOPED_TRACE(i);
    const Solid a = draw.solid();
    const Solid b = draw.solid();
    const Pose T_a = draw.pose(0.5);
    Pose T_b = draw.pose(0.5);
    const auto is_ball = [](const Solid& s) { return std::holds_alternative<Sphere>(s); };
    const auto is_tube = [](const Solid& s) { return std::holds_alternative<Cylinder>(s); };
    if ((is_tube(a) && !is_ball(b)) || (is_tube(b) && !is_ball(a))) continue;  // may be longer
    const double depth = -separation(a, T_a, b, T_b).distance;
    if (depth <= 0.0) continue;
    // no direction among many takes them apart with less
    const Vector3d direction = draw.direction();
    T_b.translation += 0.98 * depth * direction;
    EXPECT_LE(separation(a, T_a, b, T_b).distance, 0.02 * depth + 1e-9);
  }
}

TEST(Solid, SurfacePointsLieOnTheSurfaceUniformly) {
  Draws draw(5);
  for (const Solid& solid : {Solid{Sphere{0.7}},
                             Solid{Box{{0.3, 0.5, 0.9}}},
                             Solid{Cylinder{0.4, 0.8}},
                             Solid{Capsule{0.3, 0.6}}}) {
    // the flux of (0, 0, z) out of a closed surface is its volume; by symmetry half of them are up
    int up = 0;
    constexpr int kPoints = 40000;
    for (int i = 0; i < kPoints; ++i) {
      const Vector3d p = surface_point(solid, draw.uniform(0, 1), draw.uniform(0, 1));
      EXPECT_NEAR(signed_distance(solid, p), 0.0, 1e-9);
      if (p.z() > 0.5 * half_extent(solid).z()) ++up;
    }
    // share above half the height, by hand
    struct Expected {
      double operator()(const Sphere&) const { return 0.25; }
      double operator()(const Box& s) const {
        const double cap = 4 * s.half.x() * s.half.y();
        const double mantle = 8 * s.half.z() * (s.half.x() + s.half.y());
        return (cap + 0.25 * mantle) / surface_area(s);
      }
      double operator()(const Cylinder& s) const {
        const double cap = kPi * s.radius * s.radius;
        return (cap + 0.25 * 4 * kPi * s.radius * s.half_height) / surface_area(s);
      }
      double operator()(const Capsule&) const { return 0.25; }
    };
    EXPECT_NEAR(up / static_cast<double>(kPoints), std::visit(Expected{}, solid), 0.01);
  }
}

}  // namespace
}  // namespace pointflight
