// Many vehicles among obstacles: results that no thread changes, states that come from elsewhere,
// runs that are saved, restored and branched, and what goes wrong on purpose.
#include <gtest/gtest.h>

#include <map>
#include <vector>

#include "tests/sim/runs.hpp"
#include "tests/support.hpp"

namespace pointflight {
namespace {

using testing::ByteSink;
using testing::error_of;
using testing::expect_contains;
using testing::hall;

/// Twenty vehicles of three kinds, fifty obstacles, gusts.
Scenario swarm(double duration) {
  Scenario s;
  s.path = "s.yaml";
  s.duration = duration;
  s.vehicles.resize(3);
  const char* models[3] = {"quad_330", "quad_250", "hexa_550"};
  const std::int64_t counts[3] = {8, 8, 4};
  for (std::size_t i = 0; i < 3; ++i) {
    VehicleSetup& v = s.vehicles[i];
    v.model = models[i];
    v.start = {4.0 + 5.0 * static_cast<double>(i), 3, 2.5};
    v.copies = counts[i];
    v.copy_offset = {0, 2.4, 0};
    v.mission.waypoints = {{30, 6, 2.5}};
    v.lidars.front().model = "marsim_grid";
    if (i == 1) v.lidars.front().model = "mid360";
  }
  s.vehicles[2].lidars.front().renderer = "paper";
  ObstacleSettings balls;
  balls.count = 40;
  balls.size.radius = 0.1;
  balls.radius_max = 0.4;
  balls.speed = 0.5;
  balls.speed_max = 3.0;
  ObstacleSettings boxes = balls;
  boxes.count = 10;
  boxes.shape = "box";
  boxes.at_border = AtBorder::kBounce;
  s.obstacles = {balls, boxes};
  s.air.wind.mean = {1, 0.5, 0};
  s.air.wind.turbulence = Turbulence::kLight;
  s.output.odometry = true;
  return s;
}

TEST(Swarm, Threads_TheSameBytesWithOneTwoAndEightThreads) {
  std::uint64_t first = 0;
  // one thread says nothing to a sanitizer of threads
  const std::vector<int> all_threads =
      testing::kSanitized ? std::vector{2, 8} : std::vector{1, 2, 8};
  for (const int threads : all_threads) {
    const Executor executor(threads);
    Simulation simulation(swarm(testing::kSanitized ? 0.15 : 0.45), hall(), executor);
    ASSERT_EQ(simulation.vehicle_count(), 20u);
    ASSERT_EQ(simulation.obstacle_count(), 50u);
    ByteSink sink;
    while (simulation.step(sink)) {
    }
    EXPECT_EQ(sink.scans, testing::kSanitized ? 20 : 80);
    if (threads == all_threads.front()) {
      first = sink.hash();
      // they see each other and the obstacles
      int vehicles = 0;
      int obstacles = 0;
      for (const auto& [label, count] : sink.labels) {
        vehicles += label > kMapLabel && label < kFirstObstacle ? count : 0;
        obstacles += label >= kFirstObstacle ? count : 0;
      }
      EXPECT_GT(vehicles, 1000);
      EXPECT_GT(obstacles, 1000);
    }
    EXPECT_EQ(sink.hash(), first) << threads << " threads";
  }
}

TEST(Swarm, ARunIsSavedRestoredAndBranched) {
  const Executor executor(2);
  Scenario scenario = swarm(testing::kSanitized ? 0.45 : 1.0);
  scenario.vehicles.resize(2);
  for (VehicleSetup& v : scenario.vehicles) v.copies = 2;
  Simulation simulation(scenario, hall(), executor);
  ByteSink before;
  simulation.advance_to(SimTime(std::chrono::milliseconds(333)), before);
  const SimulationState saved = simulation.state();
  Simulation branch = simulation;  // goes its own way
  ByteSink first;
  while (simulation.step(first)) {
  }
  ByteSink again;
  simulation.restore(saved);
  while (simulation.step(again)) {
  }
  EXPECT_EQ(first.hash(), again.hash());
  EXPECT_EQ(simulation.end(), RunEnd::kMissionUnfinished);
  // the branch knows nothing of it, and differs if it is told something else
  EXPECT_EQ(branch.time(), SimTime(std::chrono::milliseconds(333)));
  Simulation other = branch;
  other.command(0, VelocityCommand{{0, 0, 1}, 0.0, 0.0});
  ByteSink same;
  while (branch.step(same)) {
  }
  EXPECT_EQ(same.hash(), first.hash());
  ByteSink different;
  while (other.step(different)) {
  }
  EXPECT_NE(different.hash(), first.hash());
  EXPECT_EQ(different.scans, first.scans);
}

/// States that another run has recorded.
class Recorded : public VehicleSource {
 public:
  std::map<SimTime, RigidBodyState> states;
  std::optional<SourcedState> state_at(SimTime time) override {
    const auto found = states.find(time);
    if (found == states.end()) return std::nullopt;
    return SourcedState{.body = found->second};
  }
};

TEST(Swarm, StatesFromElsewhereTakeThePlaceOfLocalOnes) {
  const Executor executor(2);
  Scenario scenario = swarm(0.45);
  scenario.vehicles.resize(1);
  scenario.vehicles[0].copies = 2;
  scenario.vehicles[0].lidars.front().model = "mid360";  // sees all around
  auto source = std::make_shared<Recorded>();
  Simulation local(scenario, hall(), executor);
  struct OfFirst : ByteSink {
    void on_sample(const Sample& sample) override {
      const auto* state = std::get_if<StateSample>(&sample);
      const auto* scanned = std::get_if<ScanSample>(&sample);
      const bool of_first = (state != nullptr && state->vehicle == 0) ||
                            (scanned != nullptr && scanned->scan->vehicle == 0) ||
                            std::holds_alternative<CollisionEvent>(sample);
      if (of_first) ByteSink::on_sample(sample);
    }
  };
  OfFirst of_local;
  do {
    source->states[local.time()] = local.status(1).state.body;
  } while (local.step(of_local));
  // the second vehicle follows what was recorded: the first one sees no difference
  Simulation remote(scenario, hall(), executor);
  remote.follow(1, source);
  OfFirst of_remote;
  while (remote.step(of_remote)) {
  }
  EXPECT_GT(of_local.labels[kFirstVehicle + 1], 0);
  EXPECT_EQ(of_remote.hash(), of_local.hash());
}

TEST(Scenario, MistakesInASwarmSayWhere) {
  const Executor executor(1);
  const auto error = [&](const std::string& text) {
    return error_of([&] {
      const Scenario scenario = parse_scenario("map: a.pfmap\n" + text, "s.yaml");
      Simulation(scenario, hall(), executor);
    });
  };
  expect_contains(error("vehicles:\n  - start: [10, 6, 3]\n  - start: [10, 6.4, 3]\n"),
                  "s.yaml:4: vehicles[1].start: drone1 starts");
  expect_contains(
      error("vehicles:\n  - start: [10, 6, 3]\n    copies: 3\n    copy_offset: [0, 0.1, 0]\n"),
      "drone1 starts");
  expect_contains(error("vehicles:\n  - model: quad_3300\n"), "s.yaml:3: vehicles[0].model");
  expect_contains(error("vehicles:\n  - name: a b\n    start: [10, 6, 3]\n"), "s.yaml:3: 'a b'");
  expect_contains(error("vehicle: {start: [10, 6, 3]}\nobstacles:\n  - radius: 7\n"),
                  "obstacles[0].motion: no free position");
  expect_contains(
      error(
          "vehicle: {start: [10, 6, 3]}\nobstacles:\n  - {motion: still, position: [10, 6, 3]}\n"),
      "inside obstacle 0");
  expect_contains(error("vehicle: {start: [10, 6, 3]}\nobstacles:\n  - {shape: cloud}\n"),
                  "needs a cloud");
  expect_contains(
      error(
          "vehicle: {start: [10, 6, 3]}\nobstacles:\n  - {motion: keyframes, keyframes: no.csv}\n"),
      "no.csv");
  expect_contains(
      error("vehicle: {start: [10, 6, 3]}\ncommands:\n  - time: 1\n    kind: rotor_speeds\n"
            "    rotors: [1, 2]\n"),
      "s.yaml:5: commands[0].kind: 2 rotor speeds for a vehicle with 4 rotors");
  expect_contains(error("vehicle: {start: [10, 6, 3]}\ncommands:\n  - {time: 2}\n  - {time: 1}\n"),
                  "s.yaml:5: 1 s comes before");
  expect_contains(error("vehicle: {start: [10, 6, 3]}\nfaults:\n  - {kind: rotor, index: 4}\n"),
                  "s.yaml:4: rotor 4 of a vehicle with 4");
  expect_contains(error("vehicle: {start: [10, 6, 3], limits: {tilt_max_deg: 120}}\n"),
                  "geometric");
  expect_contains(error("vehicle: {start: [10, 6, 3], model: lee2010, battery: true}\n"),
                  "no battery");
  expect_contains(error("vehicles: []\n"), "0 vehicles");
  const std::string start = "vehicle: {start: [10, 6, 3]}\n";
  expect_contains(error(start + "faults:\n  - {kind: scan_drop, value: 2}\n"),
                  "s.yaml:4: faults[0].value: 2 of kind scan_drop; a share");
  expect_contains(error(start + "faults:\n  - {kind: rotor, value: 60}\n"),
                  "s.yaml:4: faults[0].value: 60 of kind rotor");
  expect_contains(error(start + "faults:\n  - kind: imu\n    from: 3\n    until: 2\n"),
                  "s.yaml:6: faults[0].until: 2 s is not after 3 s");
  expect_contains(
      error(start + "commands:\n  - kind: body_rates\n    vector: [10, 0, 0]\n"),
      "s.yaml:5: commands[0].vector: has no effect here: it is for `kind: acceleration, "
      "velocity, position, waypoint; body_rates has rates_deg`");
  expect_contains(error(start + "commands:\n  - {kind: waypoint, vector: [1e300, 0, 0]}\n"),
                  "s.yaml:4: commands[0].vector: 1e300 is out of range");
  expect_contains(error(start + "mission:\n  waypoints:\n    - [1e300, 0, 0]\n"),
                  "s.yaml:5: mission.waypoints: 1e300 is out of range");
  expect_contains(
      error("vehicles:\n  - start: [10, 6, 3]\n    copies: 3\n    copy_offset: [9e6, 0, 0]\n"),
      "s.yaml:5: copy_offset takes drone2 to (1.8e+07, 6, 3); 1e+07 m");
}

TEST(Scenario, BothFormsAreOne) {
  const Scenario a = parse_scenario(
      "map: m.pfmap\nvehicle: {start: [1, 2, 3]}\nlidars: []\nmission: {waypoints: [[4, 5, 6]]}\n",
      "a.yaml");
  const Scenario b = parse_scenario(
      "map: m.pfmap\nvehicles:\n  - start: [1, 2, 3]\n    lidars: []\n    mission: {waypoints: "
      "[[4, 5, 6]]}\n",
      "b.yaml");
  Scenario long_form = a;
  long_form.is_short = false;
  EXPECT_EQ(scenario_yaml(long_form), scenario_yaml(b));
  Scenario full = swarm(3.0);
  full.map = "m.pfmap";
  full.vehicles[1].commands.resize(2);
  full.vehicles[1].faults.resize(2);
  EXPECT_EQ(scenario_yaml(parse_scenario(scenario_yaml(full), "c.yaml")), scenario_yaml(full));
}

}  // namespace
}  // namespace pointflight
