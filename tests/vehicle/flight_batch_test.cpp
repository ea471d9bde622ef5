#include "pointflight/vehicle/flight_batch.hpp"

#include <gtest/gtest.h>
#include <hwy/highway.h>

#include <cstring>

#include "pointflight/core/random.hpp"
#include "pointflight/geometry/rotation.hpp"
#include "pointflight/vehicle/autopilot.hpp"

namespace pointflight {
namespace {

constexpr std::size_t kCount = 11;  // a group and a part of one

/// What vehicle i is told in a stretch, and its air.
struct Asked {
  Vector3d vector;
  double turn;
  std::vector<double> rotors;
  Vector3d wind;
};

Asked asked(const VehicleSettings& vehicle,
            FlightLevel level,
            std::size_t i,
            std::uint64_t stretch) {
  const RandomStream random(3, StreamId::kTest, static_cast<std::uint32_t>(i));
  std::uint64_t n = 100 * stretch;
  const auto draw = [&] { return random.normal(n++); };
  const double scale = level == FlightLevel::kBodyRates ? 1.0 : 4.0;
  Asked a{scale * Vector3d(draw(), draw(), 0.5 * draw()), draw(), {}, {draw(), draw(), draw()}};
  if (level == FlightLevel::kBodyRates) a.turn = vehicle.mass * 9.81 * (1.0 + 0.3 * a.turn);
  for (std::size_t r = 0; r < vehicle.rotors.size(); ++r) {
    a.rotors.push_back(vehicle.hover_speed() * (1.0 + 0.1 * draw()));
  }
  return a;
}

Command command_of(FlightLevel level, const Asked& a, double yaw) {
  switch (level) {
    case FlightLevel::kVelocity:
      return VelocityCommand{a.vector, 0.0, a.turn, true, false};
    case FlightLevel::kAcceleration:
      return AccelerationCommand{a.vector, yaw, 0.0};
    case FlightLevel::kBodyRates:
      return BodyRateCommand{a.vector, a.turn};
    case FlightLevel::kRotorSpeeds:
      return RotorSpeedCommand{a.rotors};
  }
  return HoverCommand{};
}

bool same(const VehicleState& a, const VehicleState& b) {
  const auto equal = [](const auto& x, const auto& y) {
    return std::memcmp(x.data(), y.data(), sizeof(x)) == 0;
  };
  bool all = equal(a.body.p_world, b.body.p_world) && equal(a.body.v_world, b.body.v_world) &&
             equal(a.body.q_world_body.coeffs(), b.body.q_world_body.coeffs()) &&
             equal(a.body.omega_body, b.body.omega_body);
  for (std::size_t i = 0; i < a.rotors.size(); ++i) {
    all = all && a.rotors[i].speed == b.rotors[i].speed &&
          a.rotors[i].acceleration == b.rotors[i].acceleration;
  }
  return all;
}

/// A vehicle of the batch by itself, through Autopilot and Multirotor.
VehicleState alone(const VehicleSettings& vehicle,
                   FlightLevel level,
                   std::size_t i,
                   int stretches,
                   const FlightTiming& timing) {
  const Autopilot autopilot(vehicle, Duration{0});
  const Multirotor dynamics(vehicle);
  VehicleState state =
      dynamics.hover_at({static_cast<double>(i), 0.0, 2.0}, 0.3 * static_cast<double>(i));
  AutopilotState pilot = autopilot.start(state.body, false);
  const double dt = timing.physics_step * timing.steps_per_control;
  const double yaw = wrap_angle(yaw_of(state.body.q_world_body));
  for (int stretch = 0; stretch < stretches; ++stretch) {
    const Asked a = asked(vehicle, level, i, static_cast<std::uint64_t>(stretch));
    EXPECT_FALSE(autopilot.give(pilot, command_of(level, a, yaw), SimTime{}, state.body));
    FlightConditions conditions;
    conditions.wind_world = a.wind;
    conditions.ground_z = 1.0;
    conditions.load_share = 1.0 + 0.02 * static_cast<double>(i);
    conditions.rotor_shares.assign(vehicle.rotors.size(), 1.0);
    conditions.rotor_shares[i % vehicle.rotors.size()] = 0.98;
    for (int k = 0; k < 40; ++k) {
      const auto speeds = autopilot.rotor_speeds(pilot, state.body, false, SimTime{}, dt);
      for (int step = 0; step < timing.steps_per_control; ++step) {
        dynamics.step(state, speeds, timing.physics_step, conditions);
      }
    }
  }
  return state;
}

std::vector<VehicleState> together(const VehicleSettings& vehicle,
                                   FlightLevel level,
                                   int stretches,
                                   const FlightTiming& timing,
                                   int periods) {
  FlightBatch batch(vehicle, kCount, timing);
  const Multirotor dynamics(vehicle);
  for (std::size_t i = 0; i < kCount; ++i) {
    batch.place(
        i,
        dynamics.hover_at({static_cast<double>(i), 0.0, 2.0}, 0.3 * static_cast<double>(i)).body);
  }
  for (int stretch = 0; stretch < stretches; ++stretch) {
    for (std::size_t i = 0; i < kCount; ++i) {
      const Asked a = asked(vehicle, level, i, static_cast<std::uint64_t>(stretch));
      batch.ask(i, a.vector, level == FlightLevel::kAcceleration ? 0.0 : a.turn);
      if (level == FlightLevel::kRotorSpeeds) batch.ask_rotors(i, a.rotors.data());
      batch.set_air(i, a.wind, 1.0);
      batch.set_load(i, 1.0 + 0.02 * static_cast<double>(i));
      batch.set_rotor(i, i % vehicle.rotors.size(), 0.98);
    }
    for (int k = 0; k < 40; k += periods) batch.fly(level, periods);
  }
  std::vector<VehicleState> states;
  for (std::size_t i = 0; i < kCount; ++i) states.push_back(batch.state(i));
  return states;
}

class FlightBatchTest : public ::testing::TestWithParam<const char*> {};

TEST_P(FlightBatchTest, GivesTheBitsOfOneVehicleByItself) {
  VehicleSettings vehicle = load_vehicle(GetParam());
  vehicle.controller.kind = "geometric";
  const FlightTiming timing{0.002, 2, 2};
  for (const FlightLevel level : {FlightLevel::kVelocity,
                                  FlightLevel::kAcceleration,
                                  FlightLevel::kBodyRates,
                                  FlightLevel::kRotorSpeeds}) {
    const auto batch = together(vehicle, level, 8, timing, 40);
    for (std::size_t i = 0; i < kCount; ++i) {
      EXPECT_TRUE(same(batch[i], alone(vehicle, level, i, 8, timing)))
          << GetParam() << ", level " << static_cast<int>(level) << ", vehicle " << i << ": "
          << batch[i].body.p_world.transpose();
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Vehicles,
                         FlightBatchTest,
                         ::testing::Values("quad_330", "marsim_quad", "hexa_550", "octo_1045"),
                         [](const auto& info) { return std::string(info.param); });

TEST(FlightBatch, EachInstructionSetGivesTheSameBits) {
  VehicleSettings vehicle = load_vehicle("quad_330");
  const auto expected = together(vehicle, FlightLevel::kVelocity, 4, {0.005, 1, 1}, 40);
  for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
    hwy::SetSupportedTargetsForTest(target);
    const auto found = together(vehicle, FlightLevel::kVelocity, 4, {0.005, 1, 1}, 1);
    for (std::size_t i = 0; i < kCount; ++i) {
      EXPECT_TRUE(same(found[i], expected[i])) << hwy::TargetName(target) << ", vehicle " << i;
    }
  }
  hwy::SetSupportedTargetsForTest(0);
}

}  // namespace
}  // namespace pointflight
