#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>

#include "pointflight/core/constants.hpp"
#include "pointflight/core/hash.hpp"
#include "pointflight/core/output_file.hpp"
#include "pointflight/core/resources.hpp"
#include "pointflight/geometry/rotation.hpp"
#include "pointflight/sim/scenario.hpp"
#include "pointflight/sim/simulation.hpp"
#include "pointflight/sim/state_history.hpp"
#include "pointflight/vehicle/mission.hpp"
#include "tests/support.hpp"

namespace pointflight {
namespace {

using testing::error_of;
using testing::expect_contains;
using testing::map_of;
using testing::read_file;
using testing::TemporaryFolder;
using testing::write_file;

TEST(SmoothMove, KeepsItsLimitsAndArrives) {
  const MotionLimits limits{2.0, 1.5, 4.0};
  for (const double distance : {0.001, 0.05, 0.5, 2.0, 3.0, 40.0}) {
    SCOPED_TRACE(distance);
    const SmoothMove move(distance, limits);
    double last_speed = 0.0;
    double last_acceleration = 0.0;
    double sum = 0.0;
    const double h = move.duration() / 4000;
    for (int i = 0; i <= 4000; ++i) {
      const auto s = move.at(i * h);
      EXPECT_LE(s.speed, limits.speed * (1 + 1e-9));
      EXPECT_LE(std::abs(s.acceleration), limits.acceleration * (1 + 1e-9));
      EXPECT_LE(std::abs(s.acceleration - last_acceleration), limits.jerk * h * (1 + 1e-6));
      EXPECT_NEAR(s.speed - last_speed,
                  h * 0.5 * (s.acceleration + last_acceleration),
                  limits.jerk * h * h);
      last_speed = s.speed;
      last_acceleration = s.acceleration;
      sum += s.speed * h;
    }
    EXPECT_NEAR(sum, distance, 1e-4 * distance + 1e-9);
    EXPECT_NEAR(move.at(move.duration() - 1e-9).position, distance, 1e-6);
    EXPECT_EQ(move.at(1e9).position, distance);
    EXPECT_EQ(move.at(-1).position, 0.0);
  }
}

TEST(Mission, PassesThroughItsWaypointsAndTurnsFirst) {
  MissionSettings settings;
  settings.waypoints = {{5, 0, 0}, {5, 5, 0}, {5, 5, 3}};
  settings.hold = 0.5;
  const Mission mission({0, 0, 0}, 0.0, settings);
  EXPECT_NEAR(mission.length(), 13.0, 1e-12);
  std::vector<double> nearest(settings.waypoints.size(), 1e9);
  Vector3d last = mission.at(0.0).p_world;
  for (double t = 0; t < mission.duration() + 1; t += 0.002) {
    const PositionCommand c = mission.at(t);
    EXPECT_LT((c.p_world - last).norm(), 0.002 * 2.0 + 1e-9);
    last = c.p_world;
    for (std::size_t i = 0; i < nearest.size(); ++i) {
      nearest[i] = std::min(nearest[i], (c.p_world - settings.waypoints[i]).norm());
    }
    // moving sideways only when it looks there
    if (c.v_world.head<2>().norm() > 1e-6) {
      EXPECT_NEAR(wrap_angle(std::atan2(c.v_world.y(), c.v_world.x()) - c.yaw), 0.0, 1e-6);
    }
  }
  for (const double d : nearest) EXPECT_LT(d, 1e-6);
  EXPECT_EQ(mission.at(1e4).p_world, settings.waypoints.back());
}

TEST(Mission, HoldsAtEveryWaypointAlsoWhereItStarts) {
  MissionSettings settings;
  settings.hold = 2.0;
  settings.waypoints = {{0, 0, 1}, {4, 0, 1}, {4, 0, 1}};
  const Mission mission({0, 0, 1}, 0.0, settings);
  const double travel = SmoothMove(4.0, settings.motion).duration();
  EXPECT_DOUBLE_EQ(mission.duration(), 2.0 + travel + 2.0 + 2.0);
  EXPECT_EQ(mission.at(1.99).p_world, Vector3d(0, 0, 1));
  EXPECT_GT(mission.at(2.5).p_world.x(), 0.01);
  EXPECT_EQ(mission.at(2.0 + travel + 1.0).p_world, Vector3d(4, 0, 1));
  EXPECT_DOUBLE_EQ(mission.length(), 4.0);
}

TEST(StateHistory, InterpolatesOnTheWayAndForgetsWhatIsOld) {
  StateHistory history;
  const Quaterniond turned = quaternion_from_rpy(0, 0, 0.01);
  history.record(SimTime(Duration(0)), {Quaterniond::Identity(), {0, 0, 0}});
  history.record(SimTime(Duration(1000)), {turned, {1, 0, 0}});
  history.record(SimTime(Duration(2000)), {turned, {1, 4, 0}});
  const auto at = [&](std::int64_t ns) {
    // a track of a part says the same as one of the whole
    const SimTime time{Duration(ns)};
    const Pose pose = history.track(SimTime::min(), SimTime::max()).at(time);
    EXPECT_EQ(history.track(time, time).at(time).translation, pose.translation);
    EXPECT_EQ(history.track(time, time).at(time).rotation.coeffs(), pose.rotation.coeffs());
    return pose;
  };
  EXPECT_TRUE(at(250).translation.isApprox(Vector3d(0.25, 0, 0)));
  EXPECT_NEAR(yaw_of(at(500).rotation), 0.005, 1e-9);
  EXPECT_EQ(at(-5).translation, Vector3d(0, 0, 0));
  EXPECT_EQ(at(9999).translation, Vector3d(1, 4, 0));
  const PoseTrack kept = history.track(SimTime::min(), SimTime::max());
  history.forget_before(SimTime(Duration(1500)));
  EXPECT_TRUE(at(1500).translation.isApprox(Vector3d(1, 2, 0)));
  EXPECT_TRUE(kept.at(SimTime(Duration(250))).translation.isApprox(Vector3d(0.25, 0, 0)));
}

TEST(Scenario, WhatIsWrittenReadsBackTheSame) {
  Scenario scenario;
  scenario.map = "maps/a hall.pfmap";
  scenario.vehicles[0].mission.waypoints = {{1, 2, 3}, {4.25, -5, 6}};
  scenario.vehicles[0].lidars.push_back(
      LidarMount{"avia", {0.1, 0, 0.2}, {0, 10, 0}, "beam", true, false});
  scenario.vehicles[0].lidars.push_back(scenario.vehicles[0].lidars[0]);
  scenario.vehicles[0].lidars.back().renderer = "paper";
  const Scenario again = parse_scenario(scenario_yaml(scenario), "s.yaml");
  EXPECT_EQ(again.map, scenario.map);
  EXPECT_EQ(again.vehicles[0].mission.waypoints, scenario.vehicles[0].mission.waypoints);
  ASSERT_EQ(again.vehicles[0].lidars.size(), 3u);
  EXPECT_EQ(again.vehicles[0].lidars[2].renderer, "paper");
  EXPECT_TRUE(again.vehicles[0].lidars[1].snapshot);
  EXPECT_EQ(scenario_yaml(again), scenario_yaml(scenario));
  EXPECT_EQ(again.location("vehicles[0].mission.speed").rfind("s.yaml:", 0), 0u);
}

/// Everything that a run delivers, folded into one number.
class HashSink : public SampleSink {
 public:
  void on_sample(const Sample& sample) override {
    std::visit(Overloaded{[this](const StateSample& s) { take(s); },
                          [this](const ImuSample& s) { take(s); },
                          [this](const ScanSample& s) { take(s); },
                          [this](const CollisionEvent& s) { take(s); },
                          [](const auto&) {}},
               sample);
  }
  [[nodiscard]] std::uint64_t hash() const { return hash64(as_bytes(bytes_)); }
  int collisions = 0;
  CollisionEvent last;

 private:
  void take(const StateSample& s) {
    add(s.time.time_since_epoch().count());
    add(s.state.body.p_world.x());
    add(s.state.body.q_world_body.w());
    add(s.state.rotors[1].speed);
    if (s.nearest) add(s.nearest->distance);
  }
  void take(const ImuSample& s) {
    add(s.vehicle);
    for (int i = 0; i < 3; ++i) {
      add(s.gyro[i]);
      add(s.accel[i]);
    }
  }
  void take(const ScanSample& sample) {
    const Scan& scan = *sample.scan;
    add(static_cast<double>(scan.points.size()));
    add(sample.T_world_sensor.at(scan.start).translation.x());
    for (const ScanPoint& p : scan.points) {
      add(p.range);
      add(p.position_sensor.x());
      add(p.time_offset.count());
      add(p.label);
    }
  }
  void take(const CollisionEvent& event) {
    ++collisions;
    last = event;
  }
  template <class T>
  void add(T value) {
    const auto* raw = reinterpret_cast<const std::byte*>(&value);
    bytes_.insert(bytes_.end(), raw, raw + sizeof value);
  }
  std::vector<std::byte> bytes_;
};

std::shared_ptr<const SurfelMap> small_hall() {
  ShapeScene scene;
  scene.add_box({0, 0, 0}, {16, 10, 5});
  scene.shapes.emplace_back(Cone{{8, 5, 0}, {8, 5, 5}, 0.3, 0.3});
  return map_of(scene, 0.1, 10.0, 0.005);
}

Scenario short_flight() {
  Scenario scenario;
  scenario.path = "s.yaml";
  scenario.vehicles[0].start = {3, 3, 1.5};
  scenario.vehicles[0].mission.waypoints = {{6, 3, 2}};
  return scenario;
}

/// What there is to know of a run of one vehicle.
struct Ran : VehicleSummary {
  RunEnd end;
  SimTime time;
};

Ran run(const Scenario& scenario,
        const std::shared_ptr<const SurfelMap>& map,
        SampleSink& sink,
        int threads = 2) {
  const Executor executor(threads);
  Simulation simulation(scenario, map, executor);
  while (simulation.step(sink)) {
  }
  return {simulation.summary(0), simulation.end(), simulation.time()};
}

TEST(Simulation, FliesItsMissionAndCountsWhatItDid) {
  HashSink sink;
  const Ran s = run(short_flight(), small_hall(), sink);
  EXPECT_EQ(s.end, RunEnd::kCompleted);
  EXPECT_NEAR(s.distance_flown, 3.04, 0.1);
  EXPECT_EQ(s.collisions, 0u);
  EXPECT_LT(s.tracking_error_rms, 0.05);
  const double t = to_seconds(s.time);
  EXPECT_NEAR(static_cast<double>(s.imu_samples), 200 * t, 1.5);
  EXPECT_NEAR(static_cast<double>(s.states), 200 * t, 1.5);
  EXPECT_EQ(s.scans, static_cast<std::uint64_t>(std::floor(10 * t - 0.01)));
  EXPECT_EQ(s.beams, s.scans * 20000);
  EXPECT_GT(s.points, s.beams * 9 / 10);
  EXPECT_NEAR(*s.closest_approach, 1.5 - 0.26, 0.1);
}

TEST(Simulation, Threads_TheSameBytesWithOneTwoAndEightThreads) {
  const auto map = small_hall();
  Scenario scenario = short_flight();
  scenario.duration = 0.6;
  scenario.vehicles[0].lidars.push_back(
      LidarMount{"avia", {0.1, 0, 0}, {0, 20, 0}, "paper", true, true});
  std::uint64_t first = 0;
  for (const int threads : {1, 2, 8}) {
    HashSink sink;
    run(scenario, map, sink, threads);
    if (threads == 1) first = sink.hash();
    EXPECT_EQ(sink.hash(), first) << threads << " threads";
  }
  scenario.seed = 2;
  HashSink other;
  run(scenario, map, other, 2);
  EXPECT_NE(other.hash(), first);
}

TEST(Simulation, AddingASensorMovesNoOtherDraw) {
  const auto map = small_hall();
  class FirstScan : public SampleSink {
   public:
    void on_sample(const Sample& sample) override {
      const auto* scanned = std::get_if<ScanSample>(&sample);
      if (scanned == nullptr || scanned->scan->sensor != 0 || !points.empty()) return;
      points = scanned->scan->points;
    }
    std::vector<ScanPoint> points;
  };
  Scenario scenario = short_flight();
  scenario.duration = 0.3;
  FirstScan alone;
  run(scenario, map, alone);
  scenario.vehicles[0].lidars.push_back(LidarMount{"vlp32c"});
  FirstScan both;
  run(scenario, map, both);
  ASSERT_EQ(alone.points.size(), both.points.size());
  for (std::size_t i = 0; i < alone.points.size(); i += 97) {
    EXPECT_EQ(alone.points[i].range, both.points[i].range);
  }
}

TEST(Simulation, ReportsACollisionOrStopsAtIt) {
  const auto map = small_hall();
  Scenario scenario = short_flight();
  scenario.vehicles[0].lidars.clear();
  scenario.vehicles[0].start = {3, 5, 2};
  scenario.vehicles[0].mission.waypoints = {{13, 5, 2}};  // through the pillar
  HashSink sink;
  const Ran reported = run(scenario, map, sink);
  EXPECT_EQ(reported.end, RunEnd::kCompleted);
  EXPECT_EQ(reported.collisions, 1u);
  EXPECT_EQ(sink.collisions, 2);  // entered and left
  EXPECT_FALSE(sink.last.entered);
  scenario.vehicles[0].on_collision = CollisionReaction::kStop;
  HashSink stopped_sink;
  const Ran stopped = run(scenario, map, stopped_sink);
  EXPECT_EQ(stopped.end, RunEnd::kCollision);
  EXPECT_TRUE(stopped_sink.last.entered);
  // at the moment of contact: the sphere's radius before the pillar
  EXPECT_NEAR(stopped_sink.last.vehicle_world.x(), 8 - 0.3 - 0.26, 0.05);
  EXPECT_NEAR(stopped_sink.last.position_world.x(), 7.7, 0.12);
}

TEST(Simulation, AMissionCutShortIsUnfinished) {
  Scenario scenario = short_flight();
  scenario.vehicles[0].lidars.clear();
  scenario.duration = 1.0;
  HashSink sink;
  EXPECT_EQ(run(scenario, small_hall(), sink).end, RunEnd::kMissionUnfinished);
  scenario.unfinished = Unfinished::kTimeUp;  // as --duration asks for
  EXPECT_EQ(run(scenario, small_hall(), sink).end, RunEnd::kTimeUp);
  scenario.vehicles[0].mission.waypoints.clear();
  EXPECT_EQ(run(scenario, small_hall(), sink).end, RunEnd::kCompleted);
}

TEST(Simulation, AStartInsideTheMapIsAnError) {
  Scenario scenario =
      parse_scenario("map: a.pfmap\nvehicle:\n  model: quad_330\n  start: [8, 5.1, 1]\n", "s.yaml");
  const auto map = small_hall();
  const std::string error = error_of([&] { Simulation(scenario, map, Executor(1)); });
  expect_contains(error, "s.yaml:4: vehicle.start");
  expect_contains(error, "inside the map");
}

TEST(Simulation, Slow_WhateverTheRatesNothingIsLost) {
  Scenario scenario = short_flight();
  scenario.duration = 1.0;
  scenario.vehicles[0].lidars = {LidarMount{"d455"}};
  scenario.output.trajectory_rate = 333.0;
  HashSink sink;
  const Ran s = run(scenario, small_hall(), sink);
  EXPECT_EQ(s.states, 334u);  // k / 333 from 0 to 1 s
  EXPECT_EQ(s.scans, 30u);    // the last one ends with the run
}

TEST(Simulation, ASensorFasterThanThePhysicsLosesNoScan) {
  const TemporaryFolder folder;
  write_file(folder / "fast.yaml",
             "range_max: 50\nrate: 1000\npattern: grid\ngrid: {columns: 4, rows: 4}\n");
  Scenario scenario = short_flight();
  scenario.duration = 0.5;
  scenario.physics_step = 0.005;
  scenario.vehicles[0].lidars = {LidarMount{folder / "fast.yaml"}};
  HashSink sink;
  EXPECT_EQ(run(scenario, small_hall(), sink).scans, 500u);
}

TEST(Simulation, AFastSmallVehicleMeetsAThinWall) {
  const TemporaryFolder folder;
  std::string yaml = read_file(data_folder() + "/vehicles/quad_330.yaml");
  const std::string radius = "radius: 0.26";
  yaml.replace(yaml.find(radius), radius.size(), "radius: 0.02");
  write_file(folder / "tiny.yaml", yaml);
  ShapeScene wall;
  wall.add_rectangle({5, -4, -4}, {0, 8, 0}, {0, 0, 8});
  const auto map = map_of(wall, 0.1);
  for (int i = 0; i < 6; ++i) {  // 6 cm a step: some of these would step over it
    Scenario scenario = short_flight();
    scenario.physics_step = 0.005;
    scenario.duration = 4.0;
    scenario.vehicles[0].lidars.clear();
    scenario.vehicles[0].model = folder / "tiny.yaml";
    scenario.vehicles[0].on_collision = CollisionReaction::kStop;
    scenario.vehicles[0].start = {-5.0 + 0.01 * i, 0, 0};
    scenario.vehicles[0].mission = MissionSettings{};
    scenario.vehicles[0].mission.motion = {12.0, 20.0, 200.0};
    scenario.vehicles[0].mission.yaw = YawMode::kFixed;
    scenario.vehicles[0].mission.waypoints = {{60, 0, 0}};
    HashSink sink;
    EXPECT_EQ(run(scenario, map, sink).end, RunEnd::kCollision) << i;
  }
}

}  // namespace
}  // namespace pointflight
