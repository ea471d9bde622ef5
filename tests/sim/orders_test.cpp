// Commands of a scenario, faults, wind and battery in a flight.
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
using testing::hovering;
using testing::run;
using testing::TemporaryFolder;

TEST(Commands, OfAScenarioTakeOffFlyAndLand) {
  Scenario scenario = hovering();
  VehicleSetup& v = scenario.vehicles[0];
  v.start = {10, 6, 0.27};
  v.landed = true;
  v.commands.resize(4);
  v.commands[0].time = 0.5;
  v.commands[0].kind = "take_off";
  v.commands[0].height = 2.0;
  v.commands[1].time = 5.0;
  v.commands[1].kind = "velocity";
  v.commands[1].vector = {1, 0, 0};
  v.commands[2].time = 8.0;
  v.commands[2].kind = "hover";
  v.commands[3].time = 11.0;
  v.commands[3].kind = "land";
  scenario.duration = 20.0;
  ByteSink sink;
  const Simulation simulation = run(scenario, sink, Executor(1));
  const VehicleStatus& status = simulation.status(0);
  EXPECT_TRUE(status.landed);
  EXPECT_FALSE(status.autopilot.armed);
  EXPECT_TRUE(sink.events.empty());  // standing on the ground is no collision
  EXPECT_NEAR(status.state.body.p_world.x(), 13.2, 0.6);
  EXPECT_NEAR(status.state.body.p_world.z(), 0.27, 0.03);
  EXPECT_EQ(status.autopilot.timeouts, 0u);
  EXPECT_EQ(simulation.end(), RunEnd::kCompleted);
}

TEST(Commands, Slow_ALargeVehicleStaysOnTheGroundThatItHasLandedOn) {
  // its rotors run down slowly and lift more near the ground
  Scenario scenario = hovering();
  VehicleSetup& v = scenario.vehicles[0];
  v.model = "octo_1045";
  v.lidars.clear();
  v.start = {10, 6, 1.5};
  v.commands.resize(1);
  v.commands[0].kind = "land";
  scenario.air.wind.turbulence = Turbulence::kLight;
  scenario.duration = 8.0;
  ByteSink sink;
  const Simulation simulation = run(scenario, sink, Executor(1));
  EXPECT_TRUE(simulation.status(0).landed);
  EXPECT_TRUE(sink.events.empty());
  EXPECT_NEAR(simulation.status(0).state.body.p_world.z(), 0.2, 0.12);  // one corner first
  EXPECT_EQ(simulation.status(0).state.body.v_world, Vector3d::Zero());
  EXPECT_LT(simulation.status(0).state.rotors[0].speed, 1.0);
}

TEST(Commands, RotorSpeedsSetItDownAndLiftItAgain) {
  // as a firmware does that lands: the ground carries what comes down gently
  Scenario scenario = hovering();
  scenario.vehicles[0].start = {10, 6, 0.5};
  scenario.vehicles[0].lidars.clear();
  scenario.duration = 6.0;
  const Executor executor(1);
  Simulation simulation(scenario, testing::hall(), executor);
  ByteSink sink;
  const double hover = simulation.vehicle(0).settings().hover_speed();
  const auto turn = [&](double share, double until) {
    while (to_seconds(simulation.time()) < until) {
      simulation.command(0, RotorSpeedCommand{std::vector<double>(4, share * hover)});
      simulation.step(sink);
    }
  };
  turn(0.95, 2.0);
  EXPECT_TRUE(simulation.status(0).landed);
  EXPECT_TRUE(simulation.status(0).autopilot.armed);
  EXPECT_NEAR(simulation.status(0).state.body.p_world.z(), 0.27, 0.03);
  turn(0.5, 3.0);
  EXPECT_NEAR(simulation.status(0).state.body.p_world.z(), 0.27, 0.03);
  turn(1.1, 4.0);
  EXPECT_FALSE(simulation.status(0).landed);
  EXPECT_GT(simulation.status(0).state.body.p_world.z(), 0.6);
  EXPECT_TRUE(sink.events.empty());
}

TEST(Commands, DisarmedInTheAirItFallsAndLiesWhereItFell) {
  Scenario scenario = hovering();
  scenario.vehicles[0].commands.resize(1);
  scenario.vehicles[0].commands[0].kind = "disarm";
  ByteSink sink;
  const Simulation simulation = run(scenario, sink, Executor(1));
  EXPECT_TRUE(simulation.status(0).landed);
  EXPECT_NEAR(simulation.status(0).state.body.p_world.z(), 0.26, 0.05);
  ASSERT_FALSE(sink.events.empty());  // it fell 3 m: that is a collision
  EXPECT_EQ(sink.events[0].partner, kMapLabel);
}

TEST(Faults, DoWhatTheySay) {
  const testing::TemporaryFolder folder;
  Scenario scenario = hovering();
  VehicleSetup& v = scenario.vehicles[0];
  // readings of a part's 16 bits repeat by themselves
  v.model = testing::changed_vehicle(
      folder, "quad_330", "part: icm40609", "accel_noise_density: 6.87e-4");
  v.lidars = {LidarMount{}, LidarMount{"vlp32c"}};
  v.faults = {{.kind = FaultKind::kLidar, .from = 1.0, .until = 2.0, .index = 0},
              {.kind = FaultKind::kScanDrop, .from = 0.0, .until = 0.0, .index = 1, .value = 0.5},
              {.kind = FaultKind::kImu, .from = 0.5, .until = 0.0, .axis = ImuAxis::kAccelY},
              {.kind = FaultKind::kOdometryDelay, .from = 1.0, .until = 2.0, .value = 0.05}};
  struct Watch : SampleSink {
    void on_sample(const Sample& sample) override {
      if (const auto* scanned = std::get_if<ScanSample>(&sample)) ++scans[scanned->scan->sensor];
      if (const auto* imu = std::get_if<ImuSample>(&sample); imu && to_seconds(imu->time) > 0.5) {
        stuck.insert(imu->accel.y());
        free.insert(imu->accel.x());
      }
      if (const auto* odometry = std::get_if<OdometrySample>(&sample)) {
        late += odometry->delivered > odometry->time ? 1 : 0;
        EXPECT_GE(odometry->delivered, last);
        last = odometry->delivered;
      }
    }
    std::map<std::uint32_t, int> scans;
    std::set<double> stuck, free;
    int late = 0;
    SimTime last;
  } watch;
  run(scenario, watch, Executor(1));
  EXPECT_EQ(watch.scans[0], 20);
  EXPECT_GT(watch.scans[1], 8);
  EXPECT_LT(watch.scans[1], 22);
  EXPECT_EQ(watch.stuck.size(), 1u);
  EXPECT_GT(watch.free.size(), 100u);
  EXPECT_EQ(watch.late, 200);
  // a dead rotor
  scenario = hovering();
  scenario.vehicles[0].faults = {
      {.kind = FaultKind::kRotor, .from = 1.0, .until = 0.0, .index = 2}};
  ByteSink sink;
  const Simulation simulation = run(scenario, sink, Executor(1));
  EXPECT_LT(simulation.status(0).state.rotors[2].speed, 1.0);
  EXPECT_GT(std::abs(simulation.status(0).state.body.omega_body.z()), 5.0) << "it spins";
  EXPECT_TRUE(simulation.summary(0).rotor_lost);
  // a weak one turns with its share of the command, which may be less than the least commanded
  // speed
  scenario.vehicles[0].faults[0].value = 0.05;
  scenario.vehicles[0].faults[0].until = 1.3;
  scenario.duration = 1.25;
  const Simulation weak = run(scenario, sink, Executor(1));
  const double turns = weak.status(0).state.rotors[2].speed;
  EXPECT_LT(turns, 0.06 * weak.vehicle(0).settings().rotor.speed_max);
  EXPECT_GT(turns, 0.0);
  EXPECT_LT(turns, 0.8 * weak.vehicle(0).settings().rotor.speed_min);
}

TEST(Air, WindIsHeldAgainstAndABatterySags) {
  Scenario scenario = hovering();
  scenario.air.wind.mean = {5, 0, 0};
  scenario.duration = 20.0;
  scenario.vehicles[0].battery = true;
  ByteSink sink;
  const Simulation simulation = run(scenario, sink, Executor(1));
  const VehicleStatus& status = simulation.status(0);
  EXPECT_NEAR(status.state.body.p_world.x(), 10.0, 0.15);  // its integral holds it
  // leaning into the wind
  EXPECT_LT((status.state.body.q_world_body * Vector3d::UnitZ()).x(), -0.02);
  EXPECT_GT(status.battery.used, 0.05);
  EXPECT_LT(status.battery.voltage, 16.8);
  EXPECT_GT(status.battery.voltage, 15.0);
  EXPECT_LT(status.conditions.speed_share, 1.0);
}

}  // namespace
}  // namespace pointflight
