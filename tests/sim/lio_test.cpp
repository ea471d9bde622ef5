// A LiDAR-inertial odometry on simulated measurements: times on points, biases and fog matter to it
// as they do on hardware.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "examples/lio/judge.hpp"
#include "pointflight/core/constants.hpp"
#include "tests/sim/runs.hpp"

namespace pointflight {
namespace {

/// To and fro along a corridor, turning about z.
class SpinningToAndFro : public Trajectory {
 public:
  SpinningToAndFro(const Vector3d& start, double length, double rate)
      : start_(start), length_(length), rate_(rate) {}

  [[nodiscard]] PositionCommand at(double t) const override {
    const double w = 2.0 * kPi / duration();
    const double p = w * std::clamp(t, 0.0, duration());
    PositionCommand c;
    c.p_world = start_ + Vector3d(0.5 * length_ * (1.0 - std::cos(p)), 0, 0);
    c.v_world = Vector3d(0.5 * length_ * w * std::sin(p), 0, 0);
    c.a_world = Vector3d(0.5 * length_ * w * w * std::cos(p), 0, 0);
    // the rate is reached within the first second
    const double ramp = std::min(t, 1.0);
    c.yaw = rate_ * (0.5 * ramp * ramp + std::max(0.0, t - 1.0));
    c.yaw_rate = rate_ * ramp;
    return c;
  }
  [[nodiscard]] double duration() const override { return 12.0; }

 private:
  Vector3d start_;
  double length_, rate_;
};

/// Walls with niches, so that a position along the corridor can be told.
std::shared_ptr<const SurfelMap> corridor() {
  static const auto map = [] {
    ShapeScene scene;
    scene.add_box({0, 0, -0.2}, {20, 3, 0});
    scene.add_box({0, 0, 2.8}, {20, 3, 3});
    scene.add_box({-0.2, -1, 0}, {0, 4, 3});
    scene.add_box({20, -1, 0}, {20.2, 4, 3});
    for (int i = 0; i < 5; ++i) {  // 2.5 m of wall, 1.5 m of niche, shifted from side to side
      const double x = 4.0 * i;
      scene.add_box({x, -1, 0}, {x + 2.5, 0, 3});
      scene.add_box({x + 1.0, 3, 0}, {x + 3.5, 4, 3});
    }
    scene.add_box({0, -1.2, 0}, {20, -1, 3});
    scene.add_box({0, 4, 0}, {20, 4.2, 3});
    return testing::map_of(scene, 0.1);
  }();
  return map;
}

struct Drift {
  double share;  ///< Of the way, in the end.
  double rms;    ///< Over all scans, m.
};
Drift drift(const std::string& lidar, bool with_times, double visibility = 0.0) {
  Scenario scenario;
  scenario.path = "s.yaml";
  scenario.seed = 7;
  scenario.duration = 12.0;
  scenario.vehicles[0].start = {4.0, 1.5, 1.4};
  scenario.vehicles[0].lidars = {LidarMount{lidar}};
  if (visibility > 0.0) {
    scenario.surroundings.weather = {WeatherKind::kFog, visibility, 0.0};
  }
  const Executor executor;
  Simulation simulation(scenario, corridor(), executor);
  simulation.command(
      0, TrajectoryCommand{std::make_shared<SpinningToAndFro>(Vector3d(4.0, 1.5, 1.4), 10.0, 3.0)});
  lio::Tuning tuning;
  tuning.thinning = 0.5;  // fewer points: a test is run often
  lio::Judge judge(simulation.vehicle(0), with_times, nullptr, tuning);
  while (simulation.step(judge)) {
  }
  EXPECT_GT(judge.way(), 19.0);
  EXPECT_GT(judge.fastest_turn(), 2.8);
  return {judge.last_error() / judge.way(), judge.rms_error()};
}

TEST(Lio, Slow_NeedsTheTimesOfPointsAndAClearView) {
  for (const char* lidar : {"mid360", "avia"}) {
    SCOPED_TRACE(lidar);
    const Drift with_times = drift(lidar, true);
    EXPECT_LT(with_times.share, 0.01);
    EXPECT_GT(drift(lidar, false).rms, 2.0 * with_times.rms);
    EXPECT_GT(drift(lidar, true, 6.0).rms, with_times.rms);
  }
}

}  // namespace
}  // namespace pointflight
