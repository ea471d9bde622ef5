// What happens to vehicles in a run: collisions, obstacles, commands, faults, wind.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "pointflight/core/constants.hpp"
#include "pointflight/geometry/rotation.hpp"
#include "pointflight/world/obstacle_motion.hpp"
#include "tests/sim/runs.hpp"

namespace pointflight {
namespace {

using testing::ByteSink;
using testing::error_of;
using testing::expect_contains;
using testing::hall;
using testing::hovering;
using testing::passing;
using testing::run;
using testing::TemporaryFolder;
using testing::write_file;

TEST(Collisions, SayWhoMetWhomWhenAndWhere) {
  const Executor executor(1);
  Scenario scenario = hovering();
  scenario.obstacles = {passing(2.0)};
  ByteSink sink;
  const Simulation simulation = run(scenario, sink, executor);
  ASSERT_EQ(sink.events.size(), 2u);
  const CollisionEvent& met = sink.events[0];
  EXPECT_TRUE(met.entered);
  EXPECT_EQ(met.partner, kFirstObstacle);
  // 3 m less both radii at 2 m/s
  EXPECT_NEAR(to_seconds(met.time), (3.0 - 0.3 - 0.26) / 2.0, 1e-4);
  EXPECT_NEAR(met.position_world.y(), 6 - 0.26, 1e-3);
  EXPECT_LT(met.penetration, 2.0 * 0.001 + 1e-6);
  EXPECT_FALSE(sink.events[1].entered);
  EXPECT_NEAR(to_seconds(sink.events[1].time), (3.0 + 0.56) / 2.0, 1.5e-3);
  EXPECT_EQ(simulation.summary(0).collisions, 1u);
  EXPECT_EQ(simulation.summary(0).closest_label, kFirstObstacle);
  EXPECT_NEAR(*simulation.summary(0).closest_approach, -0.56, 0.01);
}

TEST(Collisions, OfTwoVehiclesAreBoths) {
  const Executor executor(2);
  Scenario scenario = hovering();
  scenario.vehicles.push_back(scenario.vehicles[0]);
  scenario.vehicles[0].name = "a";
  scenario.vehicles[1].name = "b";
  scenario.vehicles[1].start = {14, 6, 3};
  scenario.vehicles[1].mission.waypoints = {{6, 6, 3}};
  scenario.vehicles[1].mission.yaw = YawMode::kFixed;
  scenario.duration = 8.0;
  ByteSink sink;
  const Simulation simulation = run(scenario, sink, executor);
  ASSERT_GE(sink.events.size(), 4u);
  EXPECT_EQ(sink.events[0].vehicle, 0u);
  EXPECT_EQ(sink.events[0].partner, kFirstVehicle + 1);
  EXPECT_EQ(sink.events[1].vehicle, 1u);
  EXPECT_EQ(sink.events[1].partner, kFirstVehicle);
  EXPECT_EQ(sink.events[0].time, sink.events[1].time);
  EXPECT_EQ(simulation.summary(0).collisions, simulation.summary(1).collisions);
}

TEST(Collisions, CrashTurnsTheRotorsOffAndTheWreckLiesOnTheGround) {
  const Executor executor(1);
  Scenario scenario = hovering();
  scenario.obstacles = {passing(2.0)};
  scenario.vehicles[0].on_collision = CollisionReaction::kCrash;
  scenario.vehicles[0].commands.resize(1);  // a wreck does not start again
  scenario.vehicles[0].commands[0].time = 1.5;
  scenario.vehicles[0].commands[0].kind = "take_off";
  scenario.duration = 6.0;
  ByteSink sink;
  const Simulation simulation = run(scenario, sink, executor);
  EXPECT_TRUE(simulation.status(0).crashed);
  EXPECT_TRUE(simulation.status(0).landed);
  EXPECT_LT(simulation.status(0).state.rotors[0].speed, 1.0);
  EXPECT_NEAR(simulation.status(0).state.body.p_world.z(), 0.26, 0.1);
  EXPECT_EQ(simulation.summary(0).collisions, 1u);
  EXPECT_EQ(simulation.end(), RunEnd::kMissionUnfinished);
}

TEST(Collisions, StopEndsTheRunAtOnce) {
  const Executor executor(1);
  Scenario scenario = hovering();
  scenario.obstacles = {passing(2.0)};
  scenario.vehicles[0].on_collision = CollisionReaction::kStop;
  ByteSink sink;
  const Simulation simulation = run(scenario, sink, executor);
  EXPECT_EQ(simulation.end(), RunEnd::kCollision);
  EXPECT_NEAR(to_seconds(simulation.time()), 1.22, 0.002);
}

TEST(Obstacles, FlyStraightStayInsideAndAreReplaced) {
  Scenario scenario = hovering();
  ObstacleSettings balls;
  balls.count = 30;
  balls.speed = 4.0;
  balls.speed_max = 8.0;
  balls.size.radius = 0.2;
  balls.radius_max = 0.5;
  scenario.obstacles = {balls};
  const Executor executor(1);
  const Simulation simulation(scenario, hall(), executor);
  int replaced = 0;
  std::map<Label, Vector3d> last;
  std::map<Label, SimTime> born;
  for (int ms = 0; ms < 20000; ms += 10) {
    const SimTime t{std::chrono::milliseconds(ms)};
    int present = 0;
    for (const Body& body : simulation.obstacles(t, t)) {
      if (t < body.from || t >= body.until) continue;
      ++present;
      const Vector3d p = body.T_world_body(t).translation;
      const Aabb& box = hall()->bounds_world();
      EXPECT_GE((p - box.min).minCoeff(), -1e-6);
      EXPECT_GE((box.max - p).minCoeff(), -1e-6);
      const double radius = bounding_radius(body.shape);
      EXPECT_GE(radius, 0.2);
      EXPECT_LE(radius, 0.5);
      EXPECT_GE(body.speed_max, 4.0);
      EXPECT_LE(body.speed_max, 8.0);
      if (last.contains(body.label) && born[body.label] == body.from) {
        EXPECT_NEAR((p - last[body.label]).norm(), 0.01 * body.speed_max, 1e-9);
      } else if (last.contains(body.label)) {
        ++replaced;
        // free of the map where it appears
        const Vector3d start = body.T_world_body(body.from).translation;
        EXPECT_FALSE(hall()->nearest(start, radius - 0.01));
      }
      last[body.label] = p;
      born[body.label] = body.from;
    }
    ASSERT_EQ(present, 30);
  }
  EXPECT_GT(replaced, 30);
  // a function of seed and time: asked in any order, by anybody
  const Simulation other(scenario, hall(), executor);
  const SimTime late{std::chrono::seconds(17)};
  const auto a = simulation.obstacles(late, late);
  const auto b = other.obstacles(late, late);
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_EQ(a[i].T_world_body(late).translation, b[i].T_world_body(late).translation);
  }
}

TEST(Obstacles, BounceWhereTheyAreToldTo) {
  Scenario scenario = hovering();
  ObstacleSettings ball;
  ball.at_border = AtBorder::kBounce;
  ball.directions = FlightDirections::kHorizontal;
  ball.speed = 5.0;
  ball.bounds_min = {5, 3, 4};
  ball.bounds_max = {9, 9, 5};
  scenario.obstacles = {ball};
  const Executor executor(1);
  const Simulation simulation(scenario, hall(), executor);
  const auto bodies = simulation.obstacles(SimTime{}, SimTime(std::chrono::seconds(60)));
  ASSERT_EQ(bodies.size(), 1u);
  Vector3d last = bodies[0].T_world_body(SimTime{}).translation;
  for (int ms = 5; ms < 60000; ms += 5) {
    const Vector3d p = bodies[0].T_world_body(SimTime(std::chrono::milliseconds(ms))).translation;
    EXPECT_LE((p - last).norm(), 0.025 + 1e-9);
    EXPECT_EQ(p.z(), last.z());
    EXPECT_GE((p - ball.bounds_min).minCoeff(), 0.0);
    EXPECT_GE((ball.bounds_max - p).minCoeff(), 0.0);
    last = p;
  }
}

TEST(Obstacles, ThoseThatAreNearAreFoundWithoutLookingAtAll) {
  std::vector<ObstacleSettings> settings(4);
  settings[0].count = 300;
  settings[0].size.radius = 0.1;
  settings[0].radius_max = 0.4;
  settings[0].speed = 0.5;
  settings[0].speed_max = 30.0;  // many are replaced within a slice of time
  settings[1].count = 50;
  settings[1].at_border = AtBorder::kBounce;
  settings[1].speed = 20.0;
  settings[2] = passing(3.0);
  settings[3].motion = ObstacleMotion::kStill;
  settings[3].shape = "box";
  settings[3].position = {4, 4, 2};
  ObstacleWorld world;
  world.map = hall();
  world.location = [](std::size_t, const char*) { return std::string(); };
  const Executor executor(1);
  const Obstacles all(settings, world, executor);
  // forwards, backwards and over several slices; the same set whatever was asked before
  for (const double at : {0.0, 0.1999, 0.2, 0.7, 3.05, 1.0, 0.15}) {
    for (const double lasts : {0.0, 0.001, 0.1, 0.45}) {
      SCOPED_TRACE(fmt::format("{} {}", at, lasts));
      const SimTime from{from_seconds(at)};
      const SimTime until = from + from_seconds(lasts);
      const Vector3d place(12.0 + at, 9.0, 2.5);
      const std::vector<Body> near = all.near(place, 3.0, from, until);
      const auto is_same = [](const Body& a, const Body& b) {
        return a.label == b.label && a.from == b.from;
      };
      for (std::size_t i = 1; i < near.size(); ++i) {
        ASSERT_LE(near[i - 1].label, near[i].label);
        ASSERT_FALSE(is_same(near[i - 1], near[i]));
      }
      std::size_t wanted = 0;
      for (const Body& body : all.bodies(from, until)) {
        double closest = 1e9;
        for (int k = 0; k <= 20; ++k) {
          const SimTime t = from + from_seconds(lasts * k / 20);
          if (t < body.from || t >= body.until) continue;
          closest = std::min(closest, (body.T_world_body(t).translation - place).norm());
        }
        if (closest > 3.0 + bounding_radius(body.shape)) continue;
        ++wanted;
        ASSERT_TRUE(std::any_of(near.begin(), near.end(), [&](const Body& b) {
          return is_same(body, b) &&
                 b.T_world_body(from).translation == body.T_world_body(from).translation;
        })) << body.label;
      }
      EXPECT_GT(wanted, 0u);
      EXPECT_LT(near.size(), 200u);
    }
  }
}

TEST(Obstacles, StayInFlatBounds) {
  Scenario scenario = hovering();
  ObstacleSettings ball;
  ball.speed = 5.0;
  ball.bounds_min = {5, 3, 4};
  ball.bounds_max = {9, 9, 4};
  ObstacleSettings thin = ball;  // a life would last nanoseconds
  thin.bounds_max.z() = 4.0 + 1e-7;
  scenario.obstacles = {ball, thin};
  const Executor executor(1);
  const Simulation simulation(scenario, hall(), executor);
  for (int s = 0; s < 20; ++s) {
    const SimTime now{std::chrono::seconds(s)};
    const auto bodies = simulation.obstacles(now, now);
    ASSERT_EQ(bodies.size(), 2u);
    EXPECT_EQ(bodies[0].T_world_body(now).translation.z(), 4.0);
    EXPECT_NEAR(bodies[1].T_world_body(now).translation.z(), 4.0, 0.01);
  }
}

TEST(Obstacles, KeyframesAndLoopsAreWhereTheirFilesSay) {
  const PoseTrack keyframes = parse_keyframes(
      "time,yaw_deg,x,y,z\n# a door\n0,0,1,1,0\n2,90,1,1,0\n4,0,1,1,0\n", "door.csv", true);
  EXPECT_NEAR(yaw_of(keyframes.at(SimTime(std::chrono::seconds(1))).rotation), kPi / 4, 1e-9);
  EXPECT_NEAR(yaw_of(keyframes.at(SimTime(std::chrono::seconds(6))).rotation), kPi / 2, 1e-9);
  EXPECT_EQ(speed_max(keyframes), 0.0);
  const auto error = [](const char* text, bool repeat) {
    return error_of([&] { parse_keyframes(text, "k.csv", repeat); });
  };
  expect_contains(error("time,x,y,z\n1,0,0,0\n0.5,1,0,0\n", false),
                  "k.csv:3: time 0.5 s does not come after 1 s");
  expect_contains(error("time,x,y,z\n0,0,0,0\n1,5,0,0\n", true), "k.csv:3: repeats");
  expect_contains(error("time,x,y,z\n0,0,nan,0\n", false), "k.csv:2: ");
  expect_contains(error("time,x,y\n0,0,0\n", false), "'z");
  const LoopMotion loop = loop_through({{0, 0, 1}, {4, 0, 1}, {4, 3, 1}}, 2.0);
  EXPECT_TRUE(loop.at(SimTime(std::chrono::seconds(1))).translation.isApprox(Vector3d(2, 0, 1)));
  EXPECT_TRUE(loop.at(SimTime(std::chrono::seconds(3))).translation.isApprox(Vector3d(4, 2, 1)));
  // 12 m round at 2 m/s
  EXPECT_TRUE(loop.at(SimTime(std::chrono::seconds(7))).translation.isApprox(Vector3d(2, 0, 1)));
  EXPECT_NEAR(yaw_of(loop.at(SimTime(std::chrono::seconds(3))).rotation), kPi / 2, 1e-9);
}

TEST(Obstacles, OfACloudAreSeenAndMet) {
  const TemporaryFolder folder;
  std::string xyz;
  for (int i = 0; i < 40; ++i) {
    for (int j = 0; j < 60; ++j) {  // a person-sized cylinder
      const double a = 2 * kPi * i / 40;
      xyz += std::to_string(0.25 * std::cos(a)) + " " + std::to_string(0.25 * std::sin(a)) + " " +
             std::to_string(1.7 * j / 59) + "\n";
    }
  }
  write_file(folder / "person.xyz", xyz);
  Scenario scenario = hovering();
  scenario.vehicles[0].start = {10, 6, 1};
  scenario.vehicles[0].lidars = {LidarMount{}};
  ObstacleSettings person = passing(1.0);
  person.shape = std::nullopt;
  person.file = folder / "person.xyz";
  person.resolution = 0.05;
  person.waypoints = {{10, 4, 0}, {10, 7, 0}};
  scenario.obstacles = {person};
  ByteSink sink;
  run(scenario, sink, Executor(1));
  EXPECT_GT(sink.labels[kFirstObstacle], 500);
  ASSERT_FALSE(sink.events.empty());
  EXPECT_EQ(sink.events[0].partner, kFirstObstacle);
  EXPECT_NEAR(to_seconds(sink.events[0].time), 2.0 - 0.25 - 0.26, 0.04);
}

}  // namespace
}  // namespace pointflight
