// What ends or spoils a flight without a collision: batteries, demands beyond the vehicle, silence.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <stdexcept>

#include "pointflight/core/constants.hpp"
#include "pointflight/sim/flight_recorder.hpp"
#include "pointflight/sim/run_summary.hpp"
#include "pointflight/vehicle/feasibility.hpp"
#include "tests/sim/runs.hpp"

namespace pointflight {
namespace {

using namespace testing;

/// Keeps what happens on board.
class EventSink : public ByteSink {
 public:
  void on_sample(const Sample& sample) override {
    if (const auto* event = std::get_if<VehicleEvent>(&sample)) on_board.push_back(*event);
    ByteSink::on_sample(sample);
  }
  std::vector<VehicleEvent> on_board;
};

/// quad_330 with so small a battery, in a file of its own.
std::string with_battery(const TemporaryFolder& folder, double capacity, double reserve) {
  VehicleSettings settings = load_vehicle("quad_330");
  settings.battery.capacity = capacity;
  settings.battery.reserve = reserve;
  SettingsWriter writer;
  describe(writer, settings);
  write_file(folder / "small.yaml", writer.text());
  return folder / "small.yaml";
}

Scenario on_battery(const std::string& model, LowBatteryReaction action) {
  Scenario scenario = hovering();
  scenario.vehicles[0].model = model;
  scenario.vehicles[0].battery = true;
  scenario.vehicles[0].on_low_battery = action;
  scenario.duration = 20.0;
  return scenario;
}

TEST(Battery, LandsTheVehicleAtItsReserveAndTakesNoMoreCommands) {
  const TemporaryFolder folder;
  Scenario scenario = on_battery(with_battery(folder, 0.08, 0.5), LowBatteryReaction::kLand);
  scenario.vehicles[0].mission.waypoints = {{30, 6, 3}};
  scenario.vehicles[0].mission.motion.speed = 0.5;
  EventSink sink;
  const Executor executor(1);
  Simulation simulation(scenario, hall(), executor);
  std::optional<std::string> refused;
  while (simulation.step(sink)) {
    if (!sink.on_board.empty() && !refused) refused = simulation.command(0, TakeOffCommand{});
  }
  const VehicleStatus& status = simulation.status(0);
  ASSERT_EQ(sink.on_board.size(), 1u);
  EXPECT_EQ(sink.on_board[0].kind, "battery_low");
  expect_contains(sink.on_board[0].words, "it lands");
  ASSERT_TRUE(refused);
  expect_contains(*refused, "battery");
  EXPECT_TRUE(status.landed);
  EXPECT_FALSE(status.autopilot.armed);
  EXPECT_EQ(simulation.end(), RunEnd::kMissionUnfinished);
  EXPECT_NEAR(status.state.body.p_world.z(), 0.27, 0.03);
  EXPECT_EQ(simulation.summary(0).battery_low, sink.on_board[0].time);
  EXPECT_FALSE(simulation.summary(0).battery_empty);
  EXPECT_TRUE(sink.events.empty());
  expect_contains(summary_json(simulation), "\"battery_low_at\": ");
}

TEST(Battery, StopsTheRotorsWhenEmptyWhateverTheScenarioSays) {
  const TemporaryFolder folder;
  const std::string model = with_battery(folder, 0.04, 0.5);
  for (const auto action : {LowBatteryReaction::kReport, LowBatteryReaction::kFall}) {
    SCOPED_TRACE(static_cast<int>(action));
    EventSink sink;
    const Simulation simulation = run(on_battery(model, action), sink, Executor(1));
    const VehicleStatus& status = simulation.status(0);
    ASSERT_EQ(sink.on_board.size(), 2u);
    EXPECT_EQ(sink.on_board[0].kind, "battery_low");
    EXPECT_EQ(sink.on_board[1].kind, "battery_empty");
    // reported, it flies on with the half that is left
    const double between = to_seconds(sink.on_board[1].time - sink.on_board[0].time);
    if (action == LowBatteryReaction::kFall) {
      EXPECT_EQ(between, 0.0);
      EXPECT_NEAR(status.battery.used, 0.02, 0.002);  // rotors run down
    } else {
      EXPECT_NEAR(between, to_seconds(sink.on_board[0].time.time_since_epoch()), 0.6);
      EXPECT_DOUBLE_EQ(status.battery.used, 0.04);
    }
    EXPECT_TRUE(status.landed);  // it fell
    EXPECT_LT(status.state.rotors[0].speed, 1.0);
    EXPECT_EQ(simulation.end(), RunEnd::kMissionUnfinished);
  }
}

TEST(RotorLoss, Slow_AQuadrotorLandsSpinningAndTakesNoMoreCommands) {
  Scenario scenario = hovering();
  scenario.duration = 20.0;
  FaultSettings lost;
  lost.kind = FaultKind::kRotor;
  lost.from = 2.0;
  lost.index = 1;
  scenario.vehicles[0].faults = {lost};
  EventSink sink;
  const Executor executor(1);
  Simulation simulation(scenario, hall(), executor);
  std::optional<std::string> refused;
  while (simulation.step(sink)) {
    if (!sink.on_board.empty() && !refused) refused = simulation.command(0, HoverCommand{});
  }
  ASSERT_EQ(sink.on_board.size(), 1u);
  EXPECT_EQ(sink.on_board[0].kind, "rotor_lost");
  EXPECT_EQ(sink.on_board[0].time, SimTime{} + std::chrono::seconds(2));
  expect_contains(sink.on_board[0].words, "rotor 1 turns at 0 %");
  EXPECT_EQ(refused, "a rotor is lost: it lands");
  const VehicleStatus& status = simulation.status(0);
  EXPECT_TRUE(status.landed);
  EXPECT_EQ(simulation.summary(0).collisions, 0u);
  const Vector3d& start = scenario.vehicles[0].start;
  EXPECT_LT((status.state.body.p_world - start).head<2>().norm(), 3.0);
  expect_contains(summary_json(simulation), "\"rotor_lost_at\": 2.0");
}

/// A circle at constant speed: the analytic demand is v^2 / r.
class Circle : public Trajectory {
 public:
  Circle(const Vector3d& centre, double radius, double speed)
      : centre_(centre), radius_(radius), rate_(speed / radius) {}
  [[nodiscard]] PositionCommand at(double t) const override {
    const double a = rate_ * std::clamp(t, 0.0, duration());
    PositionCommand c;
    const Vector3d out(std::cos(a), std::sin(a), 0.0);
    c.p_world = centre_ + radius_ * out;
    c.v_world = radius_ * rate_ * Vector3d(-std::sin(a), std::cos(a), 0.0);
    c.a_world = -radius_ * rate_ * rate_ * out;
    c.jerk_world = -rate_ * rate_ * c.v_world;
    return c;
  }
  [[nodiscard]] double duration() const override { return 10.0; }

 private:
  Vector3d centre_;
  double radius_;
  double rate_;
};

TEST(Feasibility, DemandsOfACircleAreThoseOnPaper) {
  VehicleSettings vehicle = load_vehicle("quad_330");
  vehicle.drag_area.setZero();
  vehicle.rotor.drag_coefficient = 0.0;
  const MotionDemand most = demand_of(Circle({0, 0, 0}, 3.0, 6.0), vehicle);
  EXPECT_NEAR(most.speed.value, 6.0, 1e-9);
  EXPECT_NEAR(most.acceleration.value, 12.0, 1e-9);
  EXPECT_NEAR(most.climb_acceleration.value, 0.0, 1e-9);
  EXPECT_NEAR(most.tilt.value, std::atan2(12.0, kGravity), 1e-9);
  // the force keeps its length and turns once around: f' = m |jerk| across it
  EXPECT_NEAR(most.tilt_rate.value, 24.0 / std::hypot(12.0, kGravity), 1e-9);
  EXPECT_EQ(most.yaw_rate.value, 0.0);
  EXPECT_NEAR(most.thrust.value, vehicle.mass * std::hypot(12.0, kGravity), 1e-9);
  // with drag along the way the force is the hypotenuse of both
  vehicle.rotor.drag_coefficient = 2e-5;
  const double drag = 4 * 2e-5 * vehicle.hover_speed() * 6.0 / vehicle.mass;
  EXPECT_NEAR(demand_of(Circle({0, 0, 0}, 3.0, 6.0), vehicle).acceleration.value,
              std::hypot(12.0, drag),
              1e-6);
}

TEST(Feasibility, SaysWhatIsBeyondWithBothNumbers) {
  VehicleSettings vehicle = load_vehicle("quad_330");
  vehicle.drag_area.setZero();
  vehicle.rotor.drag_coefficient = 0.0;
  const auto words = beyond_limits(Circle({0, 0, 0}, 3.0, 6.0), vehicle, nullptr);
  ASSERT_TRUE(words);
  expect_contains(*words, "a tilt of 50.7 degrees (limit 35) after ");
  expect_contains(*words, "a horizontal acceleration of 12 m/s^2 (limit 7)");
  EXPECT_FALSE(beyond_limits(Circle({0, 0, 0}, 3.0, 3.0), vehicle, nullptr));
  RigidBodyState body;
  body.p_world = {3, 0, 4};
  body.v_world = {0, 3, 0};
  const auto away = beyond_limits(Circle({0, 0, 0}, 3.0, 3.0), vehicle, &body);
  ASSERT_TRUE(away);
  expect_contains(*away, "a start 4.0 m away");
  body.p_world = {3, 0, 0};
  body.v_world.setZero();
  const auto leap = beyond_limits(Circle({0, 0, 0}, 3.0, 3.0), vehicle, &body);
  ASSERT_TRUE(leap);
  expect_contains(*leap, "a leap in speed of 3.0 m/s");
}

TEST(OffTrack, AVehicleThatCannotHoldAgainstTheWindIsSaid) {
  Scenario scenario = hovering();
  scenario.duration = 4.0;
  const Executor executor(1);
  EventSink calm;
  EXPECT_EQ(run(scenario, calm, executor).summary(0).off_track, Duration{0});
  EXPECT_TRUE(calm.on_board.empty());
  scenario.air.wind.mean = {25, 0, 0};
  EventSink sink;
  const Simulation blown = run(scenario, sink, executor);
  ASSERT_GE(sink.on_board.size(), 1u);
  EXPECT_EQ(sink.on_board[0].kind, "off_track");
  expect_contains(sink.on_board[0].words, "3.0 m from where it should be in wind of 25 m/s");
  EXPECT_GT(to_seconds(blown.summary(0).off_track), 1.0);
  expect_contains(summary_json(blown), "\"off_track_time\"");
  // a position far away that it is sent to is no way
  scenario.air.wind.mean.setZero();
  EventSink sent;
  Simulation simulation(scenario, hall(), executor);
  EXPECT_FALSE(simulation.command(0, PositionCommand{.p_world = {16, 6, 3}}));
  while (simulation.step(sent)) {
  }
  EXPECT_TRUE(sent.on_board.empty());
}

TEST(Feasibility, IsSaidWhenTheCommandIsTakenAndInTheSummary) {
  Scenario scenario = hovering();
  scenario.duration = 12.0;
  const Executor executor(1);
  Simulation simulation(scenario, hall(), executor);
  EventSink sink;
  simulation.advance_to(SimTime{} + std::chrono::seconds(1), sink);
  EXPECT_TRUE(sink.on_board.empty());
  const auto circle = std::make_shared<Circle>(Vector3d(10, 3.5, 3), 2.5, 6.0);
  EXPECT_FALSE(simulation.command(0, TrajectoryCommand{circle}));
  while (simulation.step(sink)) {
  }
  ASSERT_GE(sink.on_board.size(), 1u);
  EXPECT_EQ(sink.on_board[0].kind, "beyond_limits");
  EXPECT_EQ(sink.on_board[0].time, SimTime{} + std::chrono::seconds(1));
  for (std::size_t i = 1; i < sink.on_board.size(); ++i) {
    EXPECT_EQ(sink.on_board[i].kind, "off_track") << "what came of it";
  }
  expect_contains(sink.on_board[0].words, "a tilt of");
  const VehicleSummary& summary = simulation.summary(0);
  EXPECT_EQ(summary.beyond_limits, 1u);
  EXPECT_GT(to_seconds(summary.tilt_limited + summary.acceleration_limited), 5.0);
  EXPECT_GT(summary.tracking_error_max, 0.5);
  expect_contains(summary_json(simulation), "\"trajectories_beyond_limits\": 1");
  // a mission within the limits reaches none of them
  scenario.vehicles[0].mission.waypoints = {{14, 6, 3}};
  EventSink quiet;
  const Simulation easy = run(scenario, quiet, executor);
  EXPECT_TRUE(quiet.on_board.empty());
  EXPECT_EQ(easy.summary(0).tilt_limited, Duration{0});
  EXPECT_EQ(easy.summary(0).acceleration_limited, Duration{0});
  EXPECT_EQ(easy.summary(0).rotors_limited, Duration{0});
  EXPECT_LT(easy.summary(0).tracking_error_max, 0.05);
  // one beyond them is said before anything moves
  scenario.vehicles[0].mission.motion = {20.0, 15.0, 60.0};
  EventSink said;
  run(scenario, said, executor);
  ASSERT_EQ(said.on_board.size(), 1u);
  EXPECT_EQ(said.on_board[0].time, SimTime{});
}

TEST(Idle, ARunGoesOnWhileAProgramCommandsIt) {
  Scenario scenario = hovering();
  scenario.duration = 0.0;
  const Executor executor(1);
  Simulation simulation(scenario, hall(), executor);
  ByteSink sink;
  // a planner that says where to be for 14 s, and then nothing more
  SimTime next;
  while (simulation.step(sink)) {
    if (simulation.time() < next || to_seconds(simulation.time()) > 14.0) continue;
    PositionCommand place;
    place.p_world = {11, 6, 3};
    EXPECT_FALSE(simulation.command(0, place));
    next = simulation.time() + std::chrono::milliseconds(100);
  }
  EXPECT_EQ(simulation.end(), RunEnd::kIdle);
  EXPECT_STREQ(to_string(simulation.end()), "idle");
  EXPECT_NEAR(to_seconds(simulation.time()), 24.0, 0.11);
  expect_contains(summary_json(simulation), "\"end_reason\": \"nothing left to do");
  // a trajectory is waited for, refused commands are not
  Simulation other(scenario, hall(), executor);
  WaypointCommand goal;
  goal.mission.waypoints = {{18, 6, 3}};
  goal.mission.motion.speed = 1.0;
  EXPECT_FALSE(other.command(0, goal));
  while (other.step(sink)) other.command(0, RotorSpeedCommand{});
  EXPECT_EQ(other.end(), RunEnd::kIdle);
  EXPECT_NEAR(
      to_seconds(other.time()), 10.0 + Mission({10, 6, 3}, 0, goal.mission).duration(), 0.01);
  EXPECT_NEAR(other.status(0).state.body.p_world.x(), 18.0, 0.05);
}

TEST(Idle, ALandingIsWaitedForAndSilenceIsNoCompletion) {
  Scenario scenario = hovering();
  scenario.duration = 0.0;
  const Executor executor(1);
  ByteSink sink;
  Simulation landing(scenario, hall(), executor);
  EXPECT_FALSE(landing.command(0, LandCommand{0.2}));
  while (landing.step(sink)) {
  }
  EXPECT_TRUE(landing.status(0).landed);
  EXPECT_GT(to_seconds(landing.time()), 13.0);
  EXPECT_EQ(landing.end(), RunEnd::kIdle);
  const Simulation silent = run(scenario, sink, executor);
  EXPECT_EQ(silent.end(), RunEnd::kIdle);
  EXPECT_NEAR(to_seconds(silent.time()), Simulation::kIdleTime, 0.002);
  // with a duration the scenario says when it is over
  scenario.duration = 1.0;
  EXPECT_EQ(run(scenario, sink, executor).end(), RunEnd::kCompleted);
}

TEST(SimulationCalls, WithoutSuchAVehicleAMapOrAStateOfThisRunAreRefused) {
  const Executor executor(1);
  Simulation simulation(hovering(), hall(), executor);
  EXPECT_THROW(simulation.command(3, HoverCommand{}), std::out_of_range);
  EXPECT_THROW(simulation.follow(1, nullptr), std::out_of_range);
  EXPECT_THROW(static_cast<void>(simulation.status(1)), std::out_of_range);
  EXPECT_THROW(static_cast<void>(simulation.summary(1)), std::out_of_range);
  EXPECT_THROW(static_cast<void>(simulation.vehicle(1)), std::out_of_range);
  try {
    simulation.command(3, HoverCommand{});
  } catch (const std::out_of_range& error) {
    expect_contains(error.what(), "vehicle 3 of a run with 1");
  }
  EXPECT_THROW(Simulation(hovering(), nullptr, executor), std::invalid_argument);
  SimulationState other = simulation.state();
  other.vehicles.clear();
  EXPECT_THROW(simulation.restore(other), std::invalid_argument);
  EXPECT_FALSE(simulation.command(0, HoverCommand{}));
}

TEST(SimulationCalls, ScenariosThatAProgramFilledInAreHeldToWhatFilesMaySay) {
  const Executor executor(1);
  const auto error = [&](const std::function<void(Scenario&)>& spoil) {
    Scenario scenario = hovering();
    scenario.path.clear();
    spoil(scenario);
    return error_of([&] { Simulation(scenario, hall(), executor); });
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  expect_contains(error([&](Scenario& s) { s.vehicles[0].start.y() = nan; }),
                  "scenario: vehicles[0].start: nan m is not between -10000000 and 10000000");
  expect_contains(error([&](Scenario& s) { s.physics_step = 0.0; }), "physics_step: 0 s is not");
  expect_contains(error([&](Scenario& s) { s.output.trajectory_rate = 0.0; }),
                  "output.trajectory_rate: 0 Hz");
  expect_contains(error([&](Scenario& s) { s.vehicles[0].on_collision = CollisionReaction{9}; }),
                  "on_collision: '' is unknown; one of: report, stop, crash");
  expect_contains(error([&](Scenario& s) {
                    s.vehicles[0].mission.waypoints = {{0, INFINITY, 1}};
                  }),
                  "vehicles[0].mission.waypoints: inf m");
  expect_contains(error([&](Scenario& s) {
                    s.obstacles = {passing(1.0)};
                    s.obstacles[0].speed = 0.0;
                  }),
                  "needs one above 0");
  LidarSettings lidar = load_lidar("mid360");
  lidar.rate = 0.0;
  expect_contains(error_of([&] { Lidar(lidar, 0); }), "rate: 0 Hz is not between");
  VehicleSettings vehicle = load_vehicle("quad_330");
  vehicle.mass = nan;
  expect_contains(error_of([&] { Multirotor{vehicle}; }), "mass: nan kg");
  expect_contains(error_of([&] { static_cast<void>(make_controller("cascade", vehicle)); }),
                  "mass");
}

TEST(SimulationCalls, InstantsBeyondAnyRunAreRefusedAtOnce) {
  const Executor executor(1);
  Scenario scenario = hovering();
  scenario.obstacles.resize(1);
  scenario.obstacles[0].count = 3;
  scenario.obstacles[0].size.radius = 0.1;
  Simulation simulation(scenario, hall(), executor);
  EXPECT_THROW(simulation.skip_to(SimTime(from_seconds(1e7))), std::invalid_argument);
  const SimTime far(from_seconds(1e8));
  EXPECT_THROW(static_cast<void>(simulation.obstacles(far, far)), std::invalid_argument);
  EXPECT_THROW(static_cast<void>(simulation.obstacles(simulation.time(), SimTime{} - Duration{1})),
               std::invalid_argument);
}

TEST(SimulationCalls, RotorsTurnOneWayAndATakeOffGoesUp) {
  const Executor executor(1);
  Scenario scenario = hovering();
  Simulation simulation(scenario, hall(), executor);
  const std::size_t rotors = simulation.status(0).state.rotors.size();
  RotorSpeedCommand turning{std::vector<double>(rotors, 500.0)};
  EXPECT_FALSE(simulation.command(0, turning));
  turning.speeds[0] = -1e9;
  EXPECT_TRUE(simulation.command(0, turning));
  TakeOffCommand down;
  down.height = -5.0;
  EXPECT_TRUE(simulation.command(0, down));
}

TEST(FlightRecorderCalls, AreOfOneRunAndEndOnce) {
  const testing::TemporaryFolder folder;
  const Executor executor(1);
  Scenario scenario = hovering();
  scenario.duration = 0.01;
  scenario.vehicles[0].lidars.clear();
  Simulation simulation(scenario, hall(), executor);
  FlightRecorder recorder(folder / "run", simulation);
  StateSample stranger;
  stranger.vehicle = 1;
  EXPECT_THROW(recorder.on_sample(stranger), std::invalid_argument);
  Scenario named = scenario;
  named.vehicles[0].name = "another";
  const Simulation other(named, hall(), executor);
  EXPECT_THROW(recorder.finish(other), std::invalid_argument);
  while (simulation.step(recorder)) {
  }
  recorder.finish(simulation);
  EXPECT_THROW(recorder.finish(simulation), std::logic_error);
  EXPECT_THROW(recorder.on_sample(StateSample{}), std::logic_error);
}

}  // namespace
}  // namespace pointflight
