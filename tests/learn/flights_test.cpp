#include "pointflight/learn/flights.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "pointflight/core/random.hpp"
#include "pointflight/vehicle/autopilot.hpp"
#include "pointflight/world/contact.hpp"
#include "tests/support.hpp"

namespace pointflight {
namespace {

using testing::map_of;

/// A hall of 16 x 12 x 5 m with pillars.
std::shared_ptr<const SurfelMap> pillars() {
  static const auto map = [] {
    ShapeScene scene;
    scene.add_rectangle({0, 0, 0}, {16, 0, 0}, {0, 12, 0});
    scene.add_rectangle({0, 0, 0}, {16, 0, 0}, {0, 0, 5});
    scene.add_rectangle({0, 12, 0}, {16, 0, 0}, {0, 0, 5});
    scene.add_rectangle({0, 0, 0}, {0, 12, 0}, {0, 0, 5});
    scene.add_rectangle({16, 0, 0}, {0, 12, 0}, {0, 0, 5});
    for (int i = 0; i < 3; ++i) {
      const double x = 4.0 + 4.0 * i;
      scene.add_box({x, 5.5, 0}, {x + 0.5, 6, 5});
    }
    return map_of(scene, 0.1);
  }();
  return map;
}

FlightStart at(const Vector3d& p_world, double yaw) {
  FlightStart start;
  start.p_world = p_world;
  start.yaw = yaw;
  return start;
}

/// 16 x 4 directions all around.
std::vector<Vector3f> directions() {
  std::vector<Vector3f> all;
  for (int row = 0; row < 4; ++row) {
    for (int column = 0; column < 16; ++column) {
      const double up = -0.3 + 0.2 * row;
      const double around = 2.0 * 3.14159265358979 * column / 16.0;
      all.emplace_back(static_cast<float>(std::cos(up) * std::cos(around)),
                       static_cast<float>(std::cos(up) * std::sin(around)),
                       static_cast<float>(std::sin(up)));
    }
  }
  return all;
}

std::vector<float> shares() {
  std::vector<float> all;
  for (std::size_t i = 0; i < 64; ++i) all.push_back(static_cast<float>(i % 16) / 16.0f);
  return all;
}

struct Flown {
  std::vector<RigidBodyState> bodies;
  std::vector<Flights::Status> statuses;
  std::vector<float> ranges;
};

/// Vehicle i's random walk for some actions; `count` of them at once.
Flown fly(std::size_t count, int actions, int threads, bool rolling) {
  const Executor executor(threads);
  FlightsOptions options;
  Flights flights(pillars(),
                  load_vehicle("quad_330"),
                  count,
                  options,
                  {directions(), rolling ? shares() : std::vector<float>{}, 10.0f});
  std::vector<std::uint32_t> all;
  for (std::size_t i = 0; i < count; ++i) {
    flights.place(
        i, at({2.0, 2.0 + 0.05 * static_cast<double>(i), 2.0}, 0.1 * static_cast<double>(i)));
    all.push_back(static_cast<std::uint32_t>(i));
  }
  Flown flown;
  flown.ranges.resize(count * flights.beams());
  for (int k = 0; k < actions; ++k) {
    std::vector<double> asked;
    for (std::size_t i = 0; i < count; ++i) {
      const RandomStream random(5, StreamId::kTest, static_cast<std::uint32_t>(i));
      for (std::uint64_t axis = 0; axis < 4; ++axis) {
        asked.push_back(1.5 * random.normal(static_cast<std::uint64_t>(k) * 4 + axis));
      }
    }
    flights.step(asked, {}, executor);
    flights.measure(all, flown.ranges, executor);
  }
  for (std::size_t i = 0; i < count; ++i) {
    flown.bodies.push_back(flights.body(i));
    flown.statuses.push_back(flights.status(i));
  }
  return flown;
}

TEST(Flights, Threads_DoNotDependOnThreadsOrHowManyThereAre) {
  for (const bool rolling : {false, true}) {
    const Flown one = fly(19, 20, 1, rolling);
    const Flown two = fly(19, 20, 2, rolling);
    EXPECT_EQ(one.ranges, two.ranges);
    for (std::size_t i = 0; i < 19; ++i) {
      EXPECT_EQ(one.bodies[i].p_world, two.bodies[i].p_world);
      EXPECT_EQ(one.statuses[i].clearance, two.statuses[i].clearance);
    }
    const Flown few = fly(3, 20, 1, rolling);
    for (std::size_t i = 0; i < 3; ++i) {
      EXPECT_EQ(few.bodies[i].p_world, one.bodies[i].p_world);
      EXPECT_EQ(few.statuses[i].flown, one.statuses[i].flown);
    }
    EXPECT_TRUE(std::equal(few.ranges.begin(), few.ranges.end(), one.ranges.begin()));
  }
}

TEST(Flights, RangesAreThoseOfTheRenderer) {
  const Flown flown = fly(3, 5, 1, false);
  const auto renderer = make_renderer("beam", Scene{pillars()});
  for (std::size_t i = 0; i < 3; ++i) {
    const Pose pose = flown.bodies[i].T_world_body();
    for (std::size_t k = 0; k < 64; ++k) {
      const Ray ray{pose.translation,
                    pose.rotation.toRotationMatrix().cast<float>() * directions()[k],
                    10.0f};
      const Hit hit = renderer->trace(ray);
      // directions are turned by other roundings
      EXPECT_NEAR(flown.ranges[i * 64 + k], hit.is_return() ? hit.range / 10.0f : 1.0f, 2e-6);
    }
  }
}

TEST(Flights, CollideWhereTheHullDoes) {
  const Executor executor(1);
  Flights flights(pillars(), load_vehicle("quad_330"), 3, {}, {directions(), {}, 10.0f});
  flights.place(0, at({2.0, 5.75, 2.0}, 0.0));   // towards the first pillar
  flights.place(1, at({2.0, 3.0, 2.0}, 0.0));    // past it
  flights.place(2, at({2.0, 10.0, 2.0}, 1.57));  // towards the wall
  const std::vector<double> ahead = {2, 0, 0, 0, 2, 0, 0, 0, 2, 0, 0, 0};
  const Solid hull = flights.vehicle().hull();
  int hit_pillar = -1;
  for (int k = 0; k < 15; ++k) {
    flights.step(ahead, {}, executor);
    for (std::size_t i = 0; i < 3; ++i) {
      const auto contact =
          contact_with_map(*pillars(), hull, flights.body(i).T_world_body(), Flights::kReach);
      const double distance = contact ? contact->distance : Flights::kReach;
      if (distance <= 0.0) {
        EXPECT_TRUE(flights.status(i).collided) << i;
      }
      const double clearance = flights.status(i).clearance;
      EXPECT_LE(clearance, distance + 1e-9);
      if (clearance < Flights::kExact) {
        EXPECT_EQ(clearance, distance) << i;
      }
    }
    if (hit_pillar < 0 && flights.status(0).collided) hit_pillar = k;
  }
  EXPECT_GE(hit_pillar, 5);
  EXPECT_FALSE(flights.status(1).collided);
  EXPECT_TRUE(flights.status(2).collided);
  flights.place(0, at({2.0, 3.0, 2.0}, 0.0));
  EXPECT_FALSE(flights.status(0).collided);
}

TEST(Flights, ThoseThatDoNotMoveStandStill) {
  const Executor executor(1);
  Flights moving(pillars(), load_vehicle("quad_330"), 9, {}, {directions(), {}, 10.0f});
  Flights halting(pillars(), load_vehicle("quad_330"), 9, {}, {directions(), {}, 10.0f});
  for (std::size_t i = 0; i < 9; ++i) {
    moving.place(i, at({2.0, 2.0, 2.0}, 0.0));
    halting.place(i, at({2.0, 2.0, 2.0}, 0.0));
  }
  std::vector<double> asked(36, 0.7);
  std::vector<std::uint8_t> moves(9, 1);
  moves[4] = 0;
  moving.step(asked, {}, executor);
  halting.step(asked, moves, executor);
  EXPECT_EQ(halting.body(4).p_world, Vector3d(2.0, 2.0, 2.0));
  EXPECT_EQ(halting.body(5).p_world, moving.body(5).p_world);
  std::fill(moves.begin(), moves.end(), std::uint8_t{0});
  moves[4] = 1;
  halting.step(asked, moves, executor);
  EXPECT_EQ(halting.body(4).p_world, moving.body(4).p_world);
}

/// The engine's own autopilot and dynamics, at the same steps and at 1 ms.
TEST(Flights, AgreeWithTheFullEngine) {
  const Executor executor(1);
  VehicleSettings vehicle = load_vehicle("quad_330");
  vehicle.controller.kind = "geometric";
  Flights flights(pillars(), vehicle, 1, {}, {directions(), {}, 10.0f});
  flights.place(0, at({2.0, 2.0, 2.0}, 0.3));
  const Autopilot autopilot(vehicle, Duration{0});
  const Multirotor dynamics(vehicle);
  VehicleState state = dynamics.hover_at({2.0, 2.0, 2.0}, 0.3);
  AutopilotState pilot = autopilot.start(state.body, false);
  double apart = 0.0;
  for (int k = 0; k < 100; ++k) {
    const double turn = 0.8 * std::cos(0.1 * k);
    const Vector3d v(2.0 * std::cos(0.3 * k), std::sin(0.2 * k), 0.3 * std::sin(0.5 * k));
    const double yaw = k == 0 ? 0.3 : pilot.reference.yaw;
    const double c = std::cos(yaw);
    const double s = std::sin(yaw);
    const Vector3d world(c * v.x() - s * v.y(), s * v.x() + c * v.y(), v.z());
    ASSERT_FALSE(
        autopilot.give(pilot, VelocityCommand{world, 0.0, turn, true, false}, {}, state.body));
    for (int step = 0; step < 20; ++step) {
      const auto speeds = autopilot.rotor_speeds(pilot, state.body, false, {}, 0.005);
      dynamics.step(state, speeds, 0.005);
    }
    flights.step(std::vector<double>{v.x(), v.y(), v.z(), turn}, {}, executor);
    apart = std::max(apart, (flights.body(0).p_world - state.body.p_world).norm());
  }
  EXPECT_GT((state.body.p_world - Vector3d(2, 2, 2)).norm(), 0.1);
  EXPECT_LT(apart, 1e-6);
}

TEST(Flights, FreePositionsAreFreeAndAboveGround) {
  Flights flights(pillars(), load_vehicle("quad_330"), 1, {}, {directions(), {}, 10.0f});
  const Aabb box{{0, 0, 0}, {16, 12, 5}};
  const auto positions = flights.free_positions(box, 0.6, {1.0, 3.0}, 200, 7);
  EXPECT_EQ(positions.size(), 200u);
  for (const Vector3d& p : positions) {
    EXPECT_FALSE(pillars()->nearest(p, 0.6));
    EXPECT_GT(p.z(), 0.9);
    EXPECT_LT(p.z(), 3.1);
  }
  EXPECT_EQ(flights.free_positions(box, 0.6, {1.0, 3.0}, 200, 7), positions);
  EXPECT_NE(flights.free_positions(box, 0.6, {1.0, 3.0}, 200, 8), positions);
  EXPECT_TRUE(flights.free_positions({{20, 20, 0}, {30, 30, 5}}, 0.6, {1.0, 3.0}, 5, 7).empty());
}

TEST(Flights, RefuseWhatDoesNotFit) {
  const Executor executor(1);
  FlightsOptions options;
  options.action_period = 0.0123;
  EXPECT_THROW(Flights(pillars(), load_vehicle("quad_330"), 1, options, {directions(), {}, 10.0f}),
               std::invalid_argument);
  EXPECT_THROW(RangePattern({Vector3f(1, 1, 0)}, {}, 10.0f), std::invalid_argument);
  EXPECT_THROW(RangePattern(directions(), {0.5f}, 10.0f), std::invalid_argument);
  Flights flights(pillars(), load_vehicle("quad_330"), 2, {}, {directions(), {}, 10.0f});
  EXPECT_THROW(flights.step(std::vector<double>(4), {}, executor), std::invalid_argument);
  std::vector<float> ranges(2 * 64);
  EXPECT_THROW(flights.measure(std::vector<std::uint32_t>{2}, ranges, executor),
               std::invalid_argument);
}

/// A ball that flies to and fro along y, 3 m ahead of where vehicles start.
std::shared_ptr<const Obstacles> a_ball() {
  ObstacleSettings ball;
  ball.motion = ObstacleMotion::kLoop;
  ball.waypoints = {{5.0, 2.0, 2.0}, {5.0, 4.0, 2.0}};
  ball.size.radius = 0.4;
  ObstacleWorld world;
  world.map = pillars();
  world.location = [](std::size_t, const char* key) { return std::string(key); };
  return std::make_shared<const Obstacles>(std::vector{ball}, world, Executor(1));
}

TEST(Flights, ObstaclesAreWhereTheyAreWhenEachBeamIsMeasured) {
  const Executor executor(1);
  FlightsOptions options;
  options.obstacles = a_ball();
  options.obstacle_speed = 1.0;
  const std::vector<Vector3f> ahead(3, Vector3f::UnitX());
  for (const bool rolling : {false, true}) {
    const std::vector<float> shares =
        rolling ? std::vector{0.0f, 0.5f, 1.0f} : std::vector<float>{};
    Flights flights(pillars(), load_vehicle("quad_330"), 2, options, {ahead, shares, 10.0f});
    // the ball's middle is in the beam when it is 1 s old and leaves it 0.4 s later
    FlightStart start = at({2.0, 3.0, 2.0}, 0.0);
    start.time = SimTime{} + from_seconds(1.33);
    flights.place(0, start);
    start.time = SimTime{} + from_seconds(0.95);
    flights.place(1, start);
    flights.step(std::vector<double>(8, 0.0), {}, executor);
    std::vector<float> ranges(6);
    flights.measure(std::vector<std::uint32_t>{0, 1}, ranges, executor);
    for (std::size_t k = 0; k < 3; ++k) {
      for (std::size_t i = 0; i < 2; ++i) {
        const double time =
            (i == 0 ? 1.33 : 0.95) + (rolling ? 0.05 * static_cast<double>(k) : 0.1);
        const double off = std::abs(3.0 - (2.0 + time));
        const double expected = off < 0.4 ? 3.0 - std::sqrt(0.16 - off * off) : 10.0;
        EXPECT_NEAR(10.0 * static_cast<double>(ranges[i * 3 + k]), expected, 2e-3)
            << rolling << i << k;
      }
    }
  }
}

TEST(Flights, CollideWithObstaclesAndWithinTheirTeam) {
  const Executor executor(1);
  FlightsOptions options;
  options.obstacles = a_ball();
  options.obstacle_speed = 1.0;
  options.team = 2;
  Flights flights(pillars(), load_vehicle("quad_330"), 4, options, {directions(), {}, 10.0f});
  const double radius = bounding_radius(flights.vehicle().hull());
  // vehicle 0 waits where the ball comes along; 2 and 3 fly against each other
  FlightStart start = at({5.0, 3.8, 2.0}, 0.0);
  flights.place(0, start);
  flights.place(1, at({2.0, 2.0, 2.0}, 0.0));
  flights.place(2, at({2.0, 8.0, 2.0}, 0.0));
  flights.place(3, at({5.0, 8.0, 2.0}, 0.0));
  const std::vector<double> asked = {0, 0, 0, 0, 0, 0, 0, 0, 1.5, 0, 0, 0, -1.5, 0, 0, 0};
  int first = -1;
  int second = -1;
  for (int k = 0; k < 20; ++k) {
    flights.step(asked, {}, executor);
    const double apart = (flights.body(3).p_world - flights.body(2).p_world).norm() - 2.0 * radius;
    if (apart > 0.0 && apart < Flights::kExact) {
      EXPECT_NEAR(flights.status(2).clearance, apart, 1e-6);
    }
    if (first < 0 && flights.status(0).collided) first = k;
    if (second < 0 && flights.status(2).collided) second = k;
    EXPECT_EQ(flights.status(2).collided, flights.status(3).collided);
  }
  // the ball needs 1.8 m less both radii
  EXPECT_EQ(first, static_cast<int>((1.8 - 0.4 - radius) / 0.1));
  EXPECT_GT(second, 8);
  EXPECT_FALSE(flights.status(1).collided);
  EXPECT_THROW(Flights(pillars(), load_vehicle("quad_330"), 3, options, {directions(), {}, 10.0f}),
               std::invalid_argument);
}

TEST(Flights, PooledRangesAreTheLeast) {
  const Executor executor(1);
  Flights single(pillars(), load_vehicle("quad_330"), 1, {}, {directions(), {}, 10.0f});
  Flights pooled(pillars(), load_vehicle("quad_330"), 1, {}, {directions(), {}, 10.0f, 4});
  ASSERT_EQ(pooled.beams(), 16u);
  std::vector<float> all(64);
  std::vector<float> least(16);
  for (Flights* flights : {&single, &pooled}) {
    flights->place(0, at({2.0, 3.0, 2.0}, 0.4));
  }
  single.measure(std::vector<std::uint32_t>{0}, all, executor);
  pooled.measure(std::vector<std::uint32_t>{0}, least, executor);
  for (std::size_t k = 0; k < 16; ++k) {
    EXPECT_EQ(least[k], *std::min_element(&all[4 * k], &all[4 * k] + 4));
  }
  EXPECT_THROW(RangePattern(directions(), {}, 10.0f, 5), std::invalid_argument);
}

}  // namespace
}  // namespace pointflight
