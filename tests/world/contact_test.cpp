#include "pointflight/world/contact.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "pointflight/core/constants.hpp"
#include "pointflight/core/random.hpp"
#include "pointflight/geometry/rotation.hpp"
#include "pointflight/map/internal/near_surfels.hpp"
#include "pointflight/sim/internal/proximity.hpp"
#include "tests/support.hpp"

namespace pointflight {
namespace {

using testing::map_of;

/// A room with a pillar, a ball and a slanted wall.
ShapeScene room() {
  ShapeScene scene;
  scene.add_box({0, 0, 0}, {6, 5, 3});
  scene.shapes.emplace_back(Cone{{2, 2, 0}, {2, 2, 3}, 0.2, 0.2});
  scene.shapes.emplace_back(SceneSphere{{4, 3, 1.5}, 0.5});
  scene.add_rectangle({4, 0, 0}, {1, 1, 0}, {0, 0.5, 2});
  return scene;
}

/// All surfel boxes, for brute force.
std::vector<SurfelBox> boxes_of(const SurfelMap& map) {
  std::vector<SurfelBox> boxes;
  for (std::size_t at = 0; at + kLeafPadding < map.words().size();) {
    const LeafHeader leaf = decode_leaf(map.words()[at]);
    for (std::uint32_t i = 1; i <= leaf.count; ++i) {
      boxes.push_back(surfel_box(map, leaf, static_cast<std::uint32_t>(at + i)));
    }
    at += leaf.count + 1;
  }
  return boxes;
}

class Draws {
 public:
  explicit Draws(std::uint32_t test) : random_(3, StreamId::kTest, 500 + test) {}
  double uniform(double low, double high) { return random_.uniform(next_++, low, high); }
  Pose pose() {
    const Vector3d axis(uniform(-1, 1), uniform(-1, 1), uniform(-1, 1));
    return {quaternion_from_rotation_vector(2 * axis),
            {uniform(0, 6), uniform(0, 5), uniform(0, 3)}};
  }
  Solid hull() {
    const int kind = static_cast<int>(uniform(0, 3));
    if (kind == 0) return Sphere{uniform(0.1, 0.4)};
    if (kind == 1) return Box{{uniform(0.1, 0.4), uniform(0.1, 0.4), uniform(0.05, 0.2)}};
    return Capsule{uniform(0.1, 0.3), uniform(0.05, 0.4)};
  }

 private:
  RandomStream random_;
  std::uint64_t next_ = 0;
};

TEST(Contact, Statistics_ManyQueriesEqualBruteForceOverTheSameBoxes) {
  const auto map = map_of(room(), 0.2);
  const auto boxes = boxes_of(*map);
  ASSERT_EQ(boxes.size(), map->surfel_count());
  Draws draw(1);
  constexpr int kQueries = testing::repeats(100000);
  constexpr double kReach = 0.6;
  double worst = 0.0;
  int collisions = 0;
  int far = 0;
  for (int q = 0; q < kQueries; ++q) {
    const Solid hull = draw.hull();
    const Pose pose = draw.pose();
    const auto got = contact_with_map(*map, hull, pose, kReach);
    // brute force: every box whose ball may come nearer than what is known
    double expected = kReach;
    bool any = false;
    const double radius = bounding_radius(hull);
    const auto* ball = std::get_if<Sphere>(&hull);
    for (const SurfelBox& box : boxes) {
      const double apart = (box.T_world_box.translation - pose.translation).norm();
      if (apart - radius - box.half.norm() > expected) continue;
      double d = 0.0;
      if (ball != nullptr) {
        const Vector3d local = box.T_world_box.inverse() * pose.translation;
        d = (local.cwiseAbs() - box.half).cwiseMax(0.0).norm() - ball->radius;
      } else {
        d = separation(hull, pose, Solid{Box{box.half}}, box.T_world_box).distance;
      }
      if (d <= expected) {
        expected = d;
        any = true;
      }
    }
    ASSERT_EQ(got.has_value(), any) << q;
    if (!any) {
      ++far;
      continue;
    }
    worst = std::max(worst, std::abs(got->distance - expected));
    collisions += expected <= 0.0 ? 1 : 0;
    if (std::abs(expected) > 2e-6) {
      ASSERT_EQ(got->distance <= 0.0, expected <= 0.0) << q;
    }
  }
  std::printf("100,000 queries: %d collisions, %d beyond reach, worst difference %.1e m\n",
              collisions,
              far,
              worst);
  EXPECT_LT(worst, 5e-6);  // the tree's distances are in float
  EXPECT_GT(collisions, kQueries / 10);
  EXPECT_GT(far, kQueries / 50);
}

TEST(Contact, Statistics_ErrorAgainstTheExactShapesIsASmallShareOfACell) {
  const ShapeScene scene = room();
  for (const double r : {0.05, 0.1, 0.2}) {
    const auto map = map_of(scene, r);
    Draws draw(2);
    double sum = 0.0;
    double worst = 0.0;
    int count = 0;
    for (int q = 0; q < 3000; ++q) {
      const Pose pose = draw.pose();
      const Sphere hull{0.25};
      const auto got = contact_with_map(*map, hull, pose, 2.0);
      if (!got) continue;
      // the exact distance: rays of a fine ball of directions see the nearest surface; cheaper, by
      // the shapes themselves
      double exact = 1e9;
      const Vector3d& p = pose.translation;
      exact = std::min({exact, p.x(), 6 - p.x(), p.y(), 5 - p.y(), p.z(), 3 - p.z()});
      exact = std::min(exact, std::abs(std::hypot(p.x() - 2, p.y() - 2) - 0.2));
      exact = std::min(exact, std::abs((p - Vector3d(4, 3, 1.5)).norm() - 0.5));
      // slanted parallelogram: brute force over a fine grid of it
      for (int i = 0; i <= 40; ++i) {
        for (int j = 0; j <= 80; ++j) {
          const double u = i / 40.0;
          const double v = j / 80.0;
          const Vector3d s(4 + u, u + 0.5 * v, 2 * v);
          exact = std::min(exact, (p - s).norm());
        }
      }
      const double error = std::abs(got->distance + hull.radius - exact);
      sum += error;
      worst = std::max(worst, error);
      ++count;
    }
    std::printf("r %.2f m: clearance off by %.1f mm on average, %.1f mm at most\n",
                r,
                1e3 * sum / count,
                1e3 * worst);
    EXPECT_LT(sum / count, 0.15 * r);
    EXPECT_LT(worst, 1.5 * r);
  }
}

TEST(Contact, WithBodiesIsTheSeparationOfSolids) {
  Draws draw(3);
  for (int i = 0; i < 2000; ++i) {
    const Solid hull = draw.hull();
    const Solid other = draw.hull();
    const Pose a = draw.pose();
    const Pose b = draw.pose();
    const double expected = separation(hull, a, other, b).distance;
    const auto got = contact_with_body(BodyShape{other}, b, 7, hull, a, 1.0);
    ASSERT_EQ(got.has_value(), expected <= 1.0);
    if (!got) continue;
    EXPECT_EQ(got->distance, expected);
    EXPECT_EQ(got->label, 7u);
  }
  // a body of points at a pose: as the same points in the map
  ShapeScene ball;
  ball.shapes.emplace_back(SceneSphere{Vector3d::Zero(), 0.5});
  const auto points = map_of(ball, 0.05);
  const Pose there{quaternion_from_rpy(0.3, 0.1, 1.0), {3, 1, 2}};
  const auto got = contact_with_body(
      BodyShape{points}, there, 9, Sphere{0.25}, Pose{Quaterniond::Identity(), {4.5, 1, 2}}, 2.0);
  ASSERT_TRUE(got);
  EXPECT_NEAR(got->distance, 0.75, 0.02);
  EXPECT_NEAR(got->position_world.x(), 3.5, 0.05);
}

TEST(Proximity, AWireOfSinglePointsIsMetAtTwentyMetresASecond) {
  // 2 mm thick, a point every 5 cm: one surfel per cell
  std::vector<Vector3d> wire;
  for (int i = 0; i <= 80; ++i) {
    wire.emplace_back(5.0 + 0.001 * (i % 3 - 1), 0.05 * i - 2.0, 1.0 + 0.001 * (i % 2));
  }
  const auto map = map_of(wire, 0.05);
  Draws draw(4);
  int missed = 0;
  constexpr int kPasses = 2000;
  for (int pass = 0; pass < kPasses; ++pass) {
    const double radius = draw.uniform(0.02, 0.3);
    const Solid hulls[3] = {
        Sphere{radius}, Box{{radius, radius, 0.5 * radius}}, Capsule{0.5 * radius, radius}};
    const Solid& hull = hulls[pass % 3];
    // crosses the wire's line, not always through its middle
    const double height = 1.0 + 0.4 * radius * draw.uniform(-1, 1);
    const double speed = 20.0;
    const double dt = pass % 2 == 0 ? 0.001 : 0.005;
    const Vector3d direction = Vector3d(1, 0.2 * draw.uniform(-1, 1), 0).normalized();
    const double offset = draw.uniform(0, speed * dt);
    ProximityState state;
    std::vector<CollisionEvent> events;
    for (int i = 0; i < static_cast<int>(2.0 / (speed * dt)); ++i) {
      ProximityQuery query;
      query.hull = &hull;
      query.T_world_body.translation =
          Vector3d(4.0, 0, height) + (offset + speed * dt * i) * direction;
      query.now = SimTime(from_seconds(dt * i));
      query.step = from_seconds(dt);
      query.reach = 10.0;
      sense_proximity(query, *map, {}, state, events);
    }
    const bool met = std::any_of(
        events.begin(), events.end(), [](const CollisionEvent& e) { return e.entered; });
    missed += met ? 0 : 1;
  }
  EXPECT_EQ(missed, 0);
}

TEST(Proximity, TwoThatPassThroughEachOtherWithinAStepMeet) {
  const auto map = map_of(std::vector<Vector3d>{{100, 100, 100}, {100, 100, 101}}, 0.1);
  const Solid small = Sphere{0.01};
  const BodyShape shape = small;
  ProximityState state;
  std::vector<CollisionEvent> events;
  for (int i = 0; i <= 10; ++i) {
    // 20 m/s towards each other: 40 mm a step, 20 mm of room
    ProximityQuery query;
    query.hull = &small;
    query.T_world_body.translation = {0.02 * i - 0.1, 0, 0};
    query.now = SimTime(std::chrono::milliseconds(i));
    query.step = std::chrono::milliseconds(1);
    PlacedBody other{12, &shape, 0.01, {}, {}};
    other.before.translation = {0.11 - 0.02 * (i - 1), 0.002, 0};
    other.now.translation = {0.11 - 0.02 * i, 0.002, 0};
    sense_proximity(query, *map, {&other, 1}, state, events);
  }
  ASSERT_GE(events.size(), 2u);
  EXPECT_TRUE(events[0].entered);
  EXPECT_EQ(events[0].partner, 12u);
  // they touch when 20 mm less a little apart: (0.21 - 0.02) / 40 m/s
  EXPECT_NEAR(to_seconds(events[0].time), 0.00475, 0.00002);
  EXPECT_NEAR(events[0].position_world.x(), 0.005, 0.001);
  EXPECT_FALSE(events.back().entered);
}

}  // namespace
}  // namespace pointflight
