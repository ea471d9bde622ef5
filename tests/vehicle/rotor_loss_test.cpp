// Vehicles that lose a rotor: what is left of six or eight holds the position, of four it comes
// down spinning.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "pointflight/core/constants.hpp"
#include "pointflight/core/random.hpp"
#include "pointflight/core/resources.hpp"
#include "pointflight/vehicle/bounded_least_squares.hpp"
#include "pointflight/vehicle/controller.hpp"
#include "pointflight/vehicle/mixer.hpp"
#include "pointflight/vehicle/multirotor.hpp"
#include "tests/support.hpp"

namespace pointflight {
namespace {

TEST(BoundedLeastSquares, MeetsTheConditionsOfAnOptimum) {
  const RandomStream random(11, StreamId::kTest, 0);
  std::uint64_t draw = 0;
  const auto number = [&] { return 2.0 * random.uniform2(draw++)[0] - 1.0; };
  int bound = 0;
  for (int trial = 0; trial < 300; ++trial) {
    const Eigen::Index n = 2 + trial % 7;
    const Eigen::MatrixXd a = Eigen::MatrixXd::NullaryExpr(n + 4, n, number);
    const Eigen::VectorXd b = 3.0 * Eigen::VectorXd::NullaryExpr(n + 4, number);
    const Eigen::VectorXd low = Eigen::VectorXd::NullaryExpr(n, number).cwiseMin(0.0);
    Eigen::VectorXd high = low + Eigen::VectorXd::NullaryExpr(n, number).cwiseAbs();
    if (trial % 5 == 0) high[0] = low[0];  // no room at all
    const Eigen::VectorXd x = bounded_least_squares(a, b, low, high);
    const Eigen::VectorXd pull = a.transpose() * (b - a * x);
    for (Eigen::Index i = 0; i < n; ++i) {
      ASSERT_GE(x[i], low[i]);
      ASSERT_LE(x[i], high[i]);
      if (high[i] - low[i] < 1e-9) continue;
      const bool at_low = x[i] < low[i] + 1e-9;
      const bool at_high = x[i] > high[i] - 1e-9;
      bound += at_low || at_high ? 1 : 0;
      if (!at_low) {
        EXPECT_GT(pull[i], -1e-6) << trial;
      }
      if (!at_high) {
        EXPECT_LT(pull[i], 1e-6) << trial;
      }
    }
  }
  EXPECT_GT(bound, 300);
}

TEST(Mixer, WhatIsLeftMakesTheSameWrenchWhereItCan) {
  for (const char* name : {"octo_1045", "hexa_550"}) {
    SCOPED_TRACE(name);
    const VehicleSettings vehicle = load_vehicle(name);
    const Mixer mixer(vehicle);
    const double weight = vehicle.mass * kGravity;
    for (std::size_t lost = 0; lost < vehicle.rotors.size(); ++lost) {
      for (const double left : {0.0, 0.7}) {
        std::vector<double> shares(vehicle.rotors.size(), 1.0);
        shares[lost] = left;
        EXPECT_TRUE(mixer.holds_heading(shares));
        const Wrench wanted{weight, {0.02 * weight, -0.01 * weight, 0.0}};
        std::vector<double> turning = mixer.speeds_with_failed_rotors(wanted, {}, shares);
        for (std::size_t i = 0; i < turning.size(); ++i) turning[i] *= shares[i];
        EXPECT_EQ(turning[lost] == 0.0, left == 0.0);
        const Wrench made = mixer.wrench(turning);
        EXPECT_NEAR(made.thrust / weight, 1.0, 0.02);
        EXPECT_NEAR(made.torque.x() / weight, 0.02, 5e-4);
        EXPECT_NEAR(made.torque.y() / weight, -0.01, 5e-4);
      }
    }
  }
  const VehicleSettings quad = load_vehicle("quad_330");
  EXPECT_FALSE(Mixer(quad).holds_heading(std::vector<double>{1.0, 0.0, 1.0, 1.0}));
  EXPECT_TRUE(Mixer(quad).holds_heading(std::vector<double>{1.0, 0.9, 1.0, 1.0}));
}

/// What became of a vehicle that hovers at a height of 20 m, of which a rotor has `share` of its
/// speed from second 2 on.
struct Loss {
  double sideways = 0.0;   ///< Farthest from its position, m.
  double sunk = 0.0;       ///< Farthest from the height that was asked for, m.
  double tilt_deg = 0.0;   ///< Greatest.
  double spin = 0.0;       ///< Greatest yaw rate, rad/s.
  double last_spin = 0.0;  ///< Yaw rate at the end, rad/s.
};
Loss lose_a_rotor(const VehicleSettings& vehicle,
                  std::size_t lost,
                  double share,
                  const Vector3d& wind_world,
                  double descent) {
  const Multirotor dynamics(vehicle);
  const auto controller = make_controller(vehicle.controller.kind, vehicle);
  ControllerMemory memory;
  VehicleState state = dynamics.hover_at({0, 0, 20}, 0.3);
  FlightConditions conditions;
  conditions.wind_world = wind_world;
  Loss loss;
  for (int i = 0; i < 17000; ++i) {
    const double t = 1e-3 * i;
    PositionCommand command;
    command.p_world = {0, 0, 20.0 - descent * std::max(0.0, t - 2.0)};
    if (t > 2.0) command.v_world = {0, 0, -descent};
    command.yaw = 0.3;
    if (i == 2000) {
      conditions.rotor_shares.assign(vehicle.rotors.size(), 1.0);
      conditions.rotor_shares[lost] = share;
      memory.rotor_shares = conditions.rotor_shares;
    }
    dynamics.step(state, controller->update(state.body, command, 1e-3, memory), 1e-3, conditions);
    const Vector3d off = state.body.p_world - command.p_world;
    const double up = (state.body.q_world_body * Vector3d::UnitZ()).z();
    loss.sideways = std::max(loss.sideways, std::hypot(off.x(), off.y()));
    loss.sunk = std::max(loss.sunk, std::abs(off.z()));
    loss.tilt_deg = std::max(loss.tilt_deg, std::acos(std::clamp(up, -1.0, 1.0)) / kDegree);
    loss.spin = std::max(loss.spin, std::abs(state.body.omega_body.z()));
  }
  loss.last_spin = std::abs(state.body.omega_body.z());
  return loss;
}

class RotorLoss : public ::testing::TestWithParam<const char*> {};

TEST_P(RotorLoss, Slow_SixAndEightRotorsHoldTheirPlace) {
  for (const char* name : {"hexa_550", "octo_1045"}) {
    VehicleSettings vehicle = load_vehicle(name);
    vehicle.controller.kind = GetParam();
    const std::size_t each = testing::kSanitized ? 1 : vehicle.rotors.size();
    for (std::size_t lost = 0; lost < each; ++lost) {
      SCOPED_TRACE(std::string(name) + " without rotor " + std::to_string(lost));
      const Loss calm = lose_a_rotor(vehicle, lost, 0.0, Vector3d::Zero(), 0.0);
      EXPECT_LT(calm.sideways, 0.1);
      EXPECT_LT(calm.sunk, 0.1);
      EXPECT_LT(calm.spin, 0.5);
      // what turns a hexarotor's last four about the vertical tilts them as well
      EXPECT_LT(calm.last_spin, vehicle.rotors.size() == 6 ? 0.13 : 1e-3);
    }
    EXPECT_LT(lose_a_rotor(vehicle, 1, 0.0, {3.0, 2.0, 0.0}, 0.0).sideways, 3.0);
  }
}

/// Not lee2010: its rotors' drag is so small that it does not spin, and three rotors hold a vehicle
/// upright only while it spins.
TEST_P(RotorLoss, Slow_FourComeDownInPlaceSpinning) {
  for (const char* name : {"quad_250", "quad_330", "quad_450", "marsim_quad"}) {
    SCOPED_TRACE(name);
    VehicleSettings vehicle = load_vehicle(name);
    vehicle.controller.kind = GetParam();
    for (const std::size_t lost : {0u, 3u}) {
      const Loss loss = lose_a_rotor(vehicle, lost, 0.0, Vector3d::Zero(), 1.0);
      EXPECT_LT(loss.sideways, 3.0);
      EXPECT_LT(loss.sunk, 1.5);
      EXPECT_LT(loss.tilt_deg, 50.0);
      EXPECT_GT(loss.spin, 5.0);
      // within what gyros measure, 2000 deg/s, where the file says how the air slows it
      if (!vehicle.rotational_drag.isZero()) {
        EXPECT_LT(loss.spin, 34.9);
      }
    }
  }
}

TEST_P(RotorLoss, Slow_WithoutReallocationTheyTumble) {
  VehicleSettings vehicle = load_vehicle("hexa_550");
  vehicle.controller.kind = GetParam();
  vehicle.controller.reallocate = false;
  const Loss loss = lose_a_rotor(vehicle, 0, 0.0, Vector3d::Zero(), 0.0);
  EXPECT_GT(loss.sideways + loss.sunk, 3.0);
}

INSTANTIATE_TEST_SUITE_P(Controllers, RotorLoss, ::testing::Values("cascade", "geometric"));

}  // namespace
}  // namespace pointflight
