// Every command level: against its loop's linear model, and what the autopilot makes of commands.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "pointflight/core/constants.hpp"
#include "pointflight/geometry/rotation.hpp"
#include "pointflight/vehicle/autopilot.hpp"
#include "pointflight/vehicle/multirotor.hpp"
#include "pointflight/vehicle/step_response.hpp"
#include "tests/support.hpp"

namespace pointflight {
namespace {

using testing::error_of;
using testing::expect_contains;

/// A second-order lag, advanced by small steps.
struct Lag {
  double wn, z, y = 0, dy = 0;
  double step(double u, double h) {
    if (wn <= 0.0) return y = u;
    dy += h * (wn * wn * (u - y) - 2 * z * wn * dy);
    return y += h * dy;
  }
};

/// The linear loop of a response, written apart from the controllers: what is asked for passes the
/// rotors' lag.
std::vector<double> linear_model(const StepResponse& r, const VehicleSettings& v) {
  const LoopDesign& a = v.controller.roll_pitch;
  constexpr int kFine = 20;
  const double h = r.step / kFine;
  Lag rotors{v.rotor.natural_frequency, v.rotor.damping};
  double x = 0, dx = 0, th = 0, dth = 0, integral = 0, held = 0;
  std::vector<double> y;
  for (std::size_t i = 0; i < r.value.size(); ++i) {
    const bool outer = r.name == "velocity x" || r.name == "position x";
    if (r.name == "roll rate") {
      y.push_back(dth);
    } else if (r.name == "velocity x") {
      y.push_back(dx);
    } else if (r.name == "position x") {
      y.push_back(x);
    } else {
      y.push_back(th);
    }
    for (int k = 0; k < kFine; ++k) {
      double wanted = 1.0;  // angle
      const double wn = r.design.natural_frequency;
      const double z = r.design.damping;
      if (r.name == "velocity x") {
        held += wn * wn * (1.0 - dx) * h;
        wanted = (held - 2 * z * wn * dx) / kGravity;
      } else if (r.name == "position x") {
        // with a disturbance observer: control_test.cpp
        const double pd = wn * wn * (1.0 - x) - 2 * z * wn * dx;
        wanted = (pd + r.design.integral * wn * (integral - dx)) / kGravity;
        integral += pd * h;
      }
      double command = 0.0;
      if (r.name == "roll rate") {
        command = wn * (1.0 - dth);
      } else {
        const LoopDesign& loop = outer || r.name == "acceleration x" ? a : r.design;
        command = loop.natural_frequency * loop.natural_frequency * (wanted - th) -
                  2 * loop.damping * loop.natural_frequency * dth;
      }
      dth += h * rotors.step(command, h);
      th += h * dth;
      dx += h * kGravity * th;
      x += h * dx;
    }
  }
  return y;
}

struct Case {
  const char* vehicle;
  const char* controller;
};

void PrintTo(const Case& c, std::ostream* out) {
  *out << c.vehicle << '_' << c.controller;
}

class Levels : public ::testing::TestWithParam<Case> {};

TEST_P(Levels, Statistics_FollowTheirDesignPassedThroughTheRotors) {
  VehicleSettings v = load_vehicle(GetParam().vehicle);
  v.controller.kind = GetParam().controller;
  // no drag and no limits: what the linear model describes
  v.drag_area.setZero();
  v.rotor.drag_coefficient = 0.0;
  v.controller.tilt_max_deg = 80.0;
  v.controller.acceleration_max = 100.0;
  v.controller.climb_acceleration_max = 100.0;
  for (const StepResponse& got : step_responses(v)) {
    SCOPED_TRACE(got.name);
    if (got.name == "position z") continue;  // control_test.cpp
    StepResponse wanted = got;
    wanted.value = linear_model(got, v);
    measure(wanted);
    EXPECT_NEAR(got.rise_time, wanted.rise_time, 0.06 * wanted.rise_time + 0.002);
    EXPECT_NEAR(got.overshoot, wanted.overshoot, 0.02);
    EXPECT_NEAR(got.bandwidth, wanted.bandwidth, 0.06 * wanted.bandwidth);
    double worst = 0.0;
    for (std::size_t i = 0; i < got.value.size(); ++i) {
      worst = std::max(worst, std::abs(got.value[i] - wanted.value[i]));
    }
    EXPECT_LT(worst, 0.03);
  }
}

INSTANTIATE_TEST_SUITE_P(Vehicles,
                         Levels,
                         ::testing::Values(Case{"quad_250", "cascade"},
                                           Case{"quad_330", "cascade"},
                                           Case{"quad_330", "geometric"},
                                           Case{"quad_450", "cascade"},
                                           Case{"hexa_550", "cascade"},
                                           Case{"octo_1045", "geometric"},
                                           Case{"lee2010", "cascade"}));

TEST(VehicleShow, ShippedVehiclesReachTheirDesignInTheirOwnAir) {
  for (const char* name :
       {"quad_250", "quad_330", "quad_450", "hexa_550", "octo_1045", "lee2010"}) {
    for (const StepResponse& r : step_responses(load_vehicle(name))) {
      SCOPED_TRACE(std::string(name) + " " + r.name);
      EXPECT_NEAR(r.value.back(), 1.0, 0.13);  // drag takes its part if nothing integrates
      EXPECT_LT(r.overshoot, 0.2);
      EXPECT_GT(r.bandwidth, 0.45 * r.design.natural_frequency);
    }
  }
}

/// A vehicle with its autopilot in the air.
class Flight {
 public:
  explicit Flight(const VehicleSettings& settings,
                  Duration timeout = std::chrono::milliseconds(500))
      : vehicle(settings), autopilot(settings, timeout) {
    state = vehicle.hover_at({0, 0, 10}, 0.0);
    pilot = autopilot.start(state.body, false);
  }

  std::optional<std::string> give(const Command& command) {
    return autopilot.give(pilot, command, now, state.body);
  }
  /// Flies on; `again` is repeated as a planner would.
  void fly(double seconds, const std::optional<Command>& again = std::nullopt) {
    for (int i = 0; i < static_cast<int>(std::lround(seconds * 1000)); ++i) {
      if (again && i % 10 == 0) give(*again);
      const auto speeds = autopilot.rotor_speeds(pilot, state.body, landed, now, 1e-3);
      vehicle.step(state, speeds, 1e-3);
      now += std::chrono::milliseconds(1);
      fastest_turn = std::max(fastest_turn, state.body.omega_body.norm());
    }
  }

  Multirotor vehicle;
  Autopilot autopilot;
  VehicleState state;
  AutopilotState pilot;
  SimTime now;
  bool landed = false;
  double fastest_turn = 0.0;
};

TEST(Autopilot, SwitchesLevelsInFlightWithoutAJump) {
  Flight flight(load_vehicle("quad_330"));
  flight.fly(1.0, VelocityCommand{{1, 0, 0}, 0.0, 0.0});
  flight.fly(3.0, VelocityCommand{{1, 0, 0}, 0.0, 0.0});
  EXPECT_NEAR(flight.state.body.v_world.x(), 1.0, 0.02);
  PositionCommand ahead;
  ahead.p_world = flight.state.body.p_world + Vector3d(0.5, 0, 0);
  ahead.v_world = {1, 0, 0};
  flight.fastest_turn = 0.0;
  flight.fly(0.1, ahead);
  flight.fly(2.0, AttitudeCommand{Quaterniond::Identity(), 1.6 * kGravity, Vector3d::Zero()});
  EXPECT_LT(flight.state.body.omega_body.norm(), 0.1);
  flight.fly(1.0, BodyRateCommand{{0, 0, 0.5}, 1.6 * kGravity});
  EXPECT_NEAR(flight.state.body.omega_body.z(), 0.5, 0.05);
  flight.fly(2.0, AccelerationCommand{{0, 0, 0}, 0.0, 0.0});
  EXPECT_LT(flight.fastest_turn, 3.0);
  const double hover = flight.vehicle.settings().hover_speed();
  flight.fly(0.2, RotorSpeedCommand{{hover, hover, hover, hover}});
  EXPECT_EQ(flight.pilot.rejected, 0u);
  EXPECT_EQ(flight.pilot.timeouts, 0u);
}

TEST(Autopilot, HoversWhenCommandsStop) {
  Flight flight(load_vehicle("quad_330"));
  flight.fly(3.0, VelocityCommand{{3, 0, 0}, 0.0, 0.0});
  EXPECT_NEAR(flight.state.body.v_world.x(), 3.0, 0.1);
  flight.fly(8.0);
  EXPECT_EQ(flight.pilot.timeouts, 1u);
  EXPECT_LT(flight.state.body.v_world.norm(), 0.02);
  EXPECT_NEAR(flight.state.body.p_world.z(), 10.0, 0.2);
  const Vector3d held = flight.state.body.p_world;
  flight.fly(5.0);
  EXPECT_LT((flight.state.body.p_world - held).norm(), 0.05);
  // without a watchdog it goes on
  Flight other(load_vehicle("quad_330"), Duration{0});
  other.give(VelocityCommand{{1, 0, 0}, 0.0, 0.0});
  other.fly(10.0);
  EXPECT_NEAR(other.state.body.v_world.x(), 1.0, 0.02);
  EXPECT_EQ(other.pilot.timeouts, 0u);
}

TEST(Autopilot, RefusesWhatIsNotFiniteOrNotForThisVehicleAndCounts) {
  VehicleSettings settings = load_vehicle("quad_330");
  settings.lowest_command = "velocity";
  Flight flight(settings);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  expect_contains(*flight.give(VelocityCommand{{nan, 0, 0}, 0.0, 0.0}), "velocity");
  expect_contains(*flight.give(PositionCommand{{0, 0, INFINITY}}), "not finite");
  expect_contains(*flight.give(TrajectoryCommand{}), "trajectory");
  // a trajectory of the user's own that goes wrong on its way
  class Wrong : public Trajectory {
   public:
    [[nodiscard]] PositionCommand at(double t) const override {
      PositionCommand command;
      command.p_world.x() = t > 5.0 ? 1e300 : t;
      return command;
    }
    [[nodiscard]] double duration() const override { return 10.0; }
  };
  expect_contains(*flight.give(TrajectoryCommand{std::make_shared<Wrong>()}), "not finite");
  expect_contains(*flight.give(RotorSpeedCommand{{1, 2, 3}}), "3 rotor speeds");
  expect_contains(*flight.give(BodyRateCommand{}), "takes no body_rates");
  expect_contains(*flight.give(AccelerationCommand{}), "the innermost are velocity");
  expect_contains(*flight.give(VelocityCommand{{1e300, 0, 0}, 0.0, 0.0}), "not finite");
  WaypointCommand still;
  still.mission.waypoints = {{1, 0, 10}};
  still.mission.motion.speed = 0.0;
  expect_contains(*flight.give(still), "waypoints");
  EXPECT_EQ(flight.pilot.rejected, 9u);
  flight.fly(1.0);
  EXPECT_LT((flight.state.body.p_world - Vector3d(0, 0, 10)).norm(), 1e-6);
  EXPECT_FALSE(flight.give(VelocityCommand{}));
  EXPECT_FALSE(flight.give(PositionCommand{{0, 0, 10}}));
}

TEST(Autopilot, TakesOffLandsArmsAndDisarms) {
  const VehicleSettings settings = load_vehicle("quad_330");
  Flight flight(settings);
  // on a floor at z = 10: what the simulation does for it, in short
  flight.pilot = flight.autopilot.start(flight.state.body, true);
  for (RotorState& rotor : flight.state.rotors) rotor = {};
  flight.landed = true;
  const auto on_floor = [&](double seconds) {
    for (int i = 0; i < static_cast<int>(seconds * 1000); ++i) {
      const VehicleState before = flight.state;
      flight.fly(0.001);
      if (flight.landed && flight.state.body.v_world.z() <= 0) {
        flight.state.body = before.body;
        flight.state.body.v_world.setZero();
      } else {
        flight.landed = false;
      }
      if (!flight.landed && flight.state.body.p_world.z() < 10.005 &&
          flight.state.body.v_world.z() < 0) {
        flight.landed = true;
      }
    }
  };
  on_floor(0.5);
  EXPECT_EQ(flight.state.rotors[0].speed, 0.0);
  flight.give(ArmCommand{});
  on_floor(0.5);
  EXPECT_NEAR(flight.state.rotors[0].speed, settings.rotor.speed_min, 1.0);
  // said again and again, as some programs do: it goes on with what it does
  for (int i = 0; i < 60; ++i) {
    flight.give(TakeOffCommand{2.0, 1.0});
    on_floor(0.1);
  }
  EXPECT_NEAR(flight.state.body.p_world.z(), 12.0, 0.05);
  WaypointCommand goal;
  goal.mission.waypoints = {{flight.state.body.p_world.x() + 1.0, 0.0, 0.0}};
  goal.keep_height = true;
  for (int i = 0; i < 40; ++i) {
    flight.give(goal);
    on_floor(0.1);
  }
  EXPECT_NEAR(flight.state.body.p_world.x(), goal.mission.waypoints[0].x(), 0.05);
  for (int i = 0; i < 80; ++i) {
    if (flight.pilot.armed) flight.give(LandCommand{0.5});
    on_floor(0.1);
  }
  EXPECT_TRUE(flight.landed);
  EXPECT_FALSE(flight.pilot.armed);
  EXPECT_LT(flight.state.rotors[0].speed, 1.0);
  // in the air: rotors off means falling
  Flight falling(settings);
  falling.give(DisarmCommand{});
  falling.fly(1.0);
  EXPECT_LT(falling.state.body.v_world.z(), -7.0);
}

TEST(Autopilot, LimitsComeFromTheVehicle) {
  VehicleSettings settings = load_vehicle("quad_330");
  settings.controller.speed_max = 2.0;
  settings.controller.tilt_max_deg = 15.0;
  Flight flight(settings);
  PositionCommand far;
  far.p_world = {50, 0, 10};
  double fastest = 0.0;
  double tilt = 0.0;
  for (int i = 0; i < 100; ++i) {
    flight.fly(0.1, far);
    fastest = std::max(fastest, flight.state.body.v_world.norm());
    const double up = (flight.state.body.q_world_body * Vector3d::UnitZ()).z();
    tilt = std::max(tilt, std::acos(std::min(1.0, up)) / kDegree);
  }
  EXPECT_LT(fastest, 2.1);
  EXPECT_GT(fastest, 1.8);
  EXPECT_LT(tilt, 17.0);
}

TEST(GeometricController, ComesBackFromUpsideDown) {
  VehicleSettings settings = load_vehicle("quad_250");
  settings.controller.kind = "geometric";
  settings.controller.tilt_max_deg = 180.0;
  Flight flight(settings);
  flight.state.body.q_world_body = quaternion_from_rpy(178 * kDegree, 0, 0.3);
  flight.fly(8.0);
  EXPECT_LT((flight.state.body.p_world - Vector3d(0, 0, 10)).norm(), 0.15);
  EXPECT_GT((flight.state.body.q_world_body * Vector3d::UnitZ()).z(), 0.999);
}

TEST(GeometricController, TracksATightCircleWithTheThrustFarFromUp) {
  VehicleSettings settings = load_vehicle("quad_250");
  settings.controller.kind = "geometric";
  settings.controller.tilt_max_deg = 180.0;
  settings.controller.acceleration_max = 40.0;
  settings.rotor.drag_coefficient = 0.0;  // no feed-forward for it
  const Multirotor vehicle(settings);
  const auto controller = make_controller("geometric", settings);
  ControllerMemory memory;
  // 20 m/s^2 sideways: the thrust leans by 64 degrees
  const double radius = 1.8;
  const double w = std::sqrt(20.0 / radius);
  const auto on_circle = [&](double t) {
    PositionCommand c;
    c.p_world = radius * Vector3d(std::cos(w * t), std::sin(w * t), 0);
    c.v_world = radius * w * Vector3d(-std::sin(w * t), std::cos(w * t), 0);
    c.a_world = -w * w * c.p_world;
    c.jerk_world = -w * w * c.v_world;
    return c;
  };
  VehicleState state = vehicle.hover_at(on_circle(0).p_world, 0.0);
  state.body.v_world = on_circle(0).v_world;
  double worst = 0.0;
  for (int i = 0; i < 12000; ++i) {
    const double t = i * 1e-3;
    vehicle.step(state, controller->update(state.body, on_circle(t), 1e-3, memory), 1e-3);
    if (t > 6.0) worst = std::max(worst, (state.body.p_world - on_circle(t + 1e-3).p_world).norm());
  }
  EXPECT_LT(worst, 0.25);
}

}  // namespace
}  // namespace pointflight
