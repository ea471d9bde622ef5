#include "pointflight/geometry/assembly.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "pointflight/core/constants.hpp"
#include "pointflight/core/random.hpp"
#include "pointflight/geometry/rotation.hpp"

namespace pointflight {
namespace {

Propeller seven_inch() {
  Propeller p;
  p.center = {0.1, -0.2, 0.05};
  p.radius = 0.089;
  p.hub_radius = 0.009;
  p.chord = 0.016;
  p.pitch = 14 * kDegree;
  p.blades = 2;
  p.speed = 900.0;
  return p;
}

Assembly two_parts_and_a_propeller() {
  Assembly a;
  a.parts.push_back({Box{{0.1, 0.06, 0.04}}, {quaternion_from_rpy(0.2, 0.1, 0.4), {0, 0, -0.02}}});
  a.parts.push_back({Capsule{0.01, 0.1}, {quaternion_from_rpy(kPi / 2, 0.0, 0.3), {0.1, 0.1, 0}}});
  a.propellers.push_back(seven_inch());
  return a;
}

TEST(Assembly, RaysMeetTheNearestOfItsSurfaces) {
  const Assembly a = two_parts_and_a_propeller();
  const SimTime time{from_seconds(12.3456789)};
  const std::vector<Vector3d> surface = surface_points(a, 0.004, time);
  const RandomStream random(1, StreamId::kTest, 5);
  const auto distance_to_parts = [&](const Vector3d& p) {
    double nearest = 1.0;
    for (const AssemblyPart& part : a.parts) {
      nearest = std::min(nearest,
                         std::abs(signed_distance(part.solid, part.T_assembly_part.inverse() * p)));
    }
    return nearest;
  };
  std::size_t hidden = 0;
  std::size_t missed = 0;
  for (std::size_t i = 0; i < surface.size(); ++i) {
    const auto [u, v] = random.uniform2(i);
    const double z = 2.0 * u - 1.0;
    const double level = std::sqrt(1.0 - z * z);
    const Vector3d from(
        2 * level * std::cos(2 * kPi * v), 2 * level * std::sin(2 * kPi * v), 2 * z);
    const Vector3d way = surface[i] - from;
    const auto met = intersect(a, from, way.normalized(), time);
    // aimed at a point of its surface it meets that, or something before it
    if (!met) {
      ++missed;  // right on an edge
      continue;
    }
    ASSERT_LE(met->range, way.norm() + 1e-9);
    EXPECT_LE(met->normal.dot(way), 1e-12);
    EXPECT_NEAR(met->normal.norm(), 1.0, 1e-9);
    const Vector3d place = from + met->range * way.normalized();
    const bool on_propeller = (place - a.propellers[0].center).norm() < 0.0891;
    EXPECT_TRUE(on_propeller || distance_to_parts(place) < 1e-9);
    if (met->range < way.norm() - 1e-6) ++hidden;
    EXPECT_LE(surface[i].norm(), bounding_radius(a));
  }
  EXPECT_GT(hidden, surface.size() / 5);
  EXPECT_LT(missed, 5u);
  EXPECT_FALSE(intersect(a, {2, 0, 0.5}, {-1, 0, 0}, time));
  EXPECT_FALSE(intersect(a, {2, 0, 0}, {1, 0, 0}, time));  // behind
}

TEST(Assembly, APropellerLetsThroughWhatItsBladesDoNotCover) {
  Assembly a;
  a.propellers.push_back(seven_inch());
  const Propeller& p = a.propellers[0];
  const double disc = kPi * p.radius * p.radius;
  const double covered =
      2.0 * (p.radius - p.hub_radius) * p.chord * std::cos(p.pitch) / disc;  // seen from above
  const RandomStream random(1, StreamId::kTest, 6);
  std::size_t inside = 0;
  std::size_t met = 0;
  for (std::uint64_t i = 0; i < 200000; ++i) {
    const auto [u, v] = random.uniform2(i);
    const Vector3d at(p.radius * (2 * u - 1), p.radius * (2 * v - 1), 0.0);
    if (at.norm() > p.radius) continue;
    ++inside;
    const SimTime time{from_seconds(1e-3 * static_cast<double>(i))};
    met += intersect(a, p.center + at + Vector3d(0, 0, 1), {0, 0, -1}, time) ? 1 : 0;
  }
  EXPECT_NEAR(static_cast<double>(met) / static_cast<double>(inside), covered, 0.003);
  // from the side blades are as high as their pitch makes them
  const SimTime broadside{from_seconds(0.0)};  // the first blade along x
  EXPECT_TRUE(intersect(a, p.center + Vector3d(0.05, -1, 0.0015), {0, 1, 0}, broadside));
  EXPECT_FALSE(intersect(a, p.center + Vector3d(0.05, -1, 0.0025), {0, 1, 0}, broadside));
}

TEST(Assembly, BladesTurnAsFastAndTheWayTheyAreSaidTo) {
  Assembly a;
  a.propellers.push_back(seven_inch());
  for (const double speed : {900.0, -600.0}) {
    a.propellers[0].speed = speed;
    a.propellers[0].blades = 1;
    a.propellers[0].phase = 0.3;
    for (const double t : {0.0, 0.0017, 3600.001}) {
      const double angle = 0.3 + speed * t;
      const Vector3d above = a.propellers[0].center + Vector3d(0, 0, 1);
      const Vector3d tip(0.08 * std::cos(angle), 0.08 * std::sin(angle), 0);
      const SimTime time{from_seconds(t)};
      EXPECT_TRUE(intersect(a, above + tip, {0, 0, -1}, time)) << t;
      EXPECT_FALSE(intersect(a, above - tip, {0, 0, -1}, time)) << t;
      // the leading edge is the upper one
      const Vector3d ahead =
          (speed > 0 ? 0.006 : -0.006) * Vector3d(-std::sin(angle), std::cos(angle), 0);
      const auto leading = intersect(a, above + tip + ahead, {0, 0, -1}, time);
      const auto trailing = intersect(a, above + tip - ahead, {0, 0, -1}, time);
      ASSERT_TRUE(leading && trailing);
      EXPECT_NEAR(trailing->range - leading->range, 0.012 * std::tan(14 * kDegree), 1e-6);
    }
  }
}

}  // namespace
}  // namespace pointflight
