// What an odometry is off by, and that it says so truly.
#include "pointflight/vehicle/estimate.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "pointflight/core/constants.hpp"
#include "pointflight/geometry/rotation.hpp"

namespace pointflight {
namespace {

EstimateSettings drifting() {
  EstimateSettings s;
  s.position_walk = 0.02;
  s.yaw_walk_deg = 0.3;
  s.position_noise = 0.01;
  s.yaw_noise_deg = 0.1;
  s.tilt_noise_deg = 0.2;
  s.velocity_noise = 0.05;
  return s;
}

/// Mean squared errors over many runs after `seconds`, and what the estimate states.
struct Spread {
  EstimateVariance found, stated;
};
Spread spread_after(const EstimateSettings& settings, double rate, int seconds, int every = 1) {
  constexpr int kRuns = 3000;
  Spread spread;
  for (int run = 0; run < kRuns; ++run) {
    const Estimator estimator(settings, rate, static_cast<std::uint64_t>(run), 3);
    Estimator::Memory memory;
    EstimateError e;
    const int last = static_cast<int>(rate) * seconds;
    for (int i = 0; i <= last; i += every) e = estimator.error(i, memory);
    spread.found.position += e.p_world.squaredNorm() / (3.0 * kRuns);
    spread.found.velocity += e.v_world.squaredNorm() / (3.0 * kRuns);
    spread.found.tilt += e.rotation_body.squaredNorm() / (2.0 * kRuns);
    spread.found.yaw += e.yaw * e.yaw / kRuns;
    spread.stated = estimator.variance(memory);
  }
  return spread;
}

void expect_true(const Spread& s) {
  EXPECT_NEAR(s.found.position / s.stated.position, 1.0, 0.06);
  EXPECT_NEAR(s.found.velocity / s.stated.velocity, 1.0, 0.06);
  EXPECT_NEAR(s.found.tilt / s.stated.tilt, 1.0, 0.07);
  EXPECT_NEAR(s.found.yaw / s.stated.yaw, 1.0, 0.1);
}

TEST(Estimate, DriftsAsARandomWalkAndStatesIt) {
  for (const int seconds : {1, 20}) {
    const Spread s = spread_after(drifting(), 10.0, seconds);
    expect_true(s);
    EXPECT_NEAR(s.stated.position, 0.02 * 0.02 * seconds + 1e-4, 1e-9);
    EXPECT_NEAR(s.stated.yaw / (kDegree * kDegree), 0.3 * 0.3 * seconds + 0.01, 1e-9);
  }
  // the same if reports are left out, and at another rate
  const Spread sparse = spread_after(drifting(), 10.0, 20, 4);
  expect_true(sparse);
  EXPECT_NEAR(sparse.stated.position, 0.02 * 0.02 * 20 + 1e-4, 1e-9);
}

TEST(Estimate, DriftStaysWithinItsLimit) {
  EstimateSettings s = drifting();
  s.position_limit = 0.1;
  s.yaw_limit_deg = 1.0;
  // begins as the walk: time constants are 50 and 22 s
  const Spread early = spread_after(s, 10.0, 1);
  expect_true(early);
  EXPECT_NEAR(early.stated.position, 0.02 * 0.02 + 1e-4, 2e-5);
  const Spread late = spread_after(s, 2.0, 300);
  expect_true(late);
  EXPECT_NEAR(late.stated.position, 0.1 * 0.1 + 1e-4, 1e-6);
  EXPECT_NEAR(late.stated.yaw / (kDegree * kDegree), 1.0 + 0.01, 1e-3);
}

TEST(Estimate, IsTheTruthWhereNothingErrs) {
  EstimateSettings s;
  EXPECT_TRUE(s.is_true());
  s.latency = 0.1;
  s.dropout = 0.5;
  EXPECT_TRUE(s.is_true());
  EXPECT_FALSE(drifting().is_true());
  RigidBodyState truth;
  truth.p_world = {1, 2, 3};
  truth.v_world = {2, 0, 1};
  truth.q_world_body = quaternion_from_rpy(0.1, -0.2, 0.7);
  const RigidBodyState same = EstimateError{}.on(truth);
  EXPECT_EQ(same.p_world, truth.p_world);
  EXPECT_LT(same.q_world_body.angularDistance(truth.q_world_body), 1e-12);
  // a heading that is off turns the velocity in the world, but not in the body
  EstimateError turned;
  turned.yaw = 0.5;
  turned.p_world = {0, 0, 1};
  const RigidBodyState off = turned.on(truth);
  EXPECT_NEAR(yaw_of(off.q_world_body) - yaw_of(truth.q_world_body), 0.5, 1e-12);
  EXPECT_LT(
      (off.q_world_body.conjugate() * off.v_world - truth.q_world_body.conjugate() * truth.v_world)
          .norm(),
      1e-12);
  EXPECT_EQ(off.p_world, Vector3d(1, 2, 4));
}

TEST(Estimate, LosesTheShareOfItsReports) {
  EstimateSettings s;
  s.dropout = 0.3;
  const Estimator estimator(s, 100.0, 5, 0);
  int lost = 0;
  for (int i = 0; i < 20000; ++i) lost += estimator.loses(i) ? 1 : 0;
  EXPECT_NEAR(lost / 20000.0, 0.3, 0.015);
}

}  // namespace
}  // namespace pointflight
