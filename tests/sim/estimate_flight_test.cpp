// Flights on an odometry that errs: what the controller takes for the truth moves the vehicle.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/sim/runs.hpp"

namespace pointflight {
namespace {

using namespace testing;

class OdometrySink : public ByteSink {
 public:
  void on_sample(const Sample& sample) override {
    if (const auto* odometry = std::get_if<OdometrySample>(&sample)) all.push_back(*odometry);
    ByteSink::on_sample(sample);
  }
  std::vector<OdometrySample> all;
};

Scenario drifting(ControllerInput input) {
  Scenario scenario = hovering();
  scenario.duration = 20.0;
  scenario.output.odometry_rate = 50.0;
  VehicleSetup& vehicle = scenario.vehicles[0];
  vehicle.controller_input = input;
  vehicle.odometry.position_walk = 0.1;
  vehicle.odometry.yaw_walk_deg = 1.0;
  vehicle.odometry.latency = 0.03;
  vehicle.odometry.dropout = 0.2;
  return scenario;
}

TEST(EstimateFlight, OneThatFliesOnItsOdometryGoesWhereThatTakesItselfToBe) {
  const Executor executor(1);
  OdometrySink sink;
  const Scenario scenario = drifting(ControllerInput::kOdometry);
  const Simulation simulation = run(scenario, sink, executor);
  const Vector3d& start = scenario.vehicles[0].start;
  ASSERT_GT(sink.all.size(), 600u);
  EXPECT_LT(sink.all.size(), 900u) << "a fifth is lost";
  double believed = 0.0;
  double truly = 0.0;
  for (const OdometrySample& s : sink.all) {
    EXPECT_EQ(s.delivered - s.time, from_seconds(0.03));
    EXPECT_LT((s.state.p_world - s.truth.p_world - s.error.p_world).norm(), 1e-9);
    EXPECT_GE(s.variance.position, 0.0);
    believed += (s.state.p_world - start).squaredNorm();
    truly += (s.truth.p_world - start).squaredNorm();
  }
  const auto count = static_cast<double>(sink.all.size());
  EXPECT_LT(std::sqrt(believed / count), 0.15) << "by its odometry it hovers";
  EXPECT_GT(std::sqrt(truly / count), 0.3) << "in truth it does not";
}

TEST(EstimateFlight, OneThatFliesOnTheTruthStaysWhereItIs) {
  const Executor executor(1);
  OdometrySink sink;
  const Scenario scenario = drifting(ControllerInput::kTruth);
  run(scenario, sink, executor);
  double farthest = 0.0;
  for (const OdometrySample& s : sink.all) {
    EXPECT_LT((s.truth.p_world - scenario.vehicles[0].start).norm(), 0.01);
    farthest = std::max(farthest, (s.state.p_world - s.truth.p_world).norm());
  }
  EXPECT_GT(farthest, 0.25);
}

TEST(EstimateFlight, TheSameSeedDriftsTheSame) {
  const Executor executor(1);
  OdometrySink one;
  OdometrySink other;
  run(drifting(ControllerInput::kOdometry), one, executor);
  run(drifting(ControllerInput::kOdometry), other, executor);
  ASSERT_EQ(one.all.size(), other.all.size());
  EXPECT_EQ(one.all.back().state.p_world, other.all.back().state.p_world);
}

}  // namespace
}  // namespace pointflight
