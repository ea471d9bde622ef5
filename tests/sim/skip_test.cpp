// Time that a run jumps over, and runs that go on where a log ends.
#include <gtest/gtest.h>

#include "tests/share/members.hpp"

namespace pointflight {
namespace {

using testing::ByteSink;
using testing::hall;
using testing::through_each_other;

TEST(Simulation, Slow_TimeThatIsSkippedHasNotPassedForVehicles) {
  Scenario scenario = through_each_other();
  scenario.vehicles.resize(1);
  scenario.vehicles[0].lidars.resize(1);
  scenario.vehicles[0].lidars[0].model = "marsim_grid";
  scenario.vehicles[0].mission.waypoints.resize(2);
  scenario.duration = 0.0;
  const Executor executor(1);
  Simulation simulation(scenario, hall(), executor);
  struct Times : SampleSink {
    std::vector<SimTime> scans, states;
    void on_sample(const Sample& sample) override {
      if (const auto* scan = std::get_if<ScanSample>(&sample)) scans.push_back(scan->scan->start);
      if (const auto* state = std::get_if<StateSample>(&sample)) states.push_back(state->time);
    }
  } times;
  simulation.advance_to(SimTime(std::chrono::milliseconds(1234)), times);
  const auto before = simulation.status(0).state.body;
  const SimTime end = simulation.end_time();
  simulation.skip_to(SimTime(std::chrono::milliseconds(7777)));
  EXPECT_EQ(simulation.status(0).state.body.p_world, before.p_world);
  EXPECT_EQ(simulation.simulated(), Duration(std::chrono::milliseconds(1234)));
  EXPECT_EQ(simulation.end_time() - end, Duration(std::chrono::milliseconds(7777 - 1234)));
  while (simulation.step(times)) {
  }
  EXPECT_EQ(simulation.end(), RunEnd::kCompleted);  // its whole mission, later
  EXPECT_LT(simulation.summary(0).tracking_error_max, 0.2);
  for (std::size_t i = 1; i < times.scans.size(); ++i) {
    const Duration gap = times.scans[i] - times.scans[i - 1];
    EXPECT_TRUE(gap == std::chrono::milliseconds(100) ||
                times.scans[i] == SimTime(std::chrono::milliseconds(7800)));
  }
  // the first scan after the jump begins with the next turn
  EXPECT_EQ(
      std::count(times.scans.begin(), times.scans.end(), SimTime(std::chrono::milliseconds(7800))),
      1);
  EXPECT_TRUE(std::is_sorted(times.states.begin(), times.states.end()));
  EXPECT_THROW(simulation.skip_to(SimTime{}), std::invalid_argument);
  Simulation other(scenario, hall(), executor);
  EXPECT_THROW(other.skip_to(SimTime(Duration(1'500'000))), std::invalid_argument);
}

TEST(Simulation, GoesOnWhereALogEnds) {
  Scenario scenario = through_each_other();
  scenario.vehicles.resize(1);
  scenario.duration = 0.0;
  const Executor executor(1);
  Simulation whole(scenario, hall(), executor);
  ByteSink sink;
  whole.advance_to(SimTime(std::chrono::seconds(4)), sink);
  Simulation resumed(scenario, hall(), executor);
  resumed.resume_at(SimTime(std::chrono::seconds(4)), Duration{0}, {{0, whole.status(0).state}});
  whole.advance_to(SimTime(std::chrono::seconds(9)), sink);
  resumed.advance_to(SimTime(std::chrono::seconds(9)), sink);
  // but for what its controllers have forgotten
  EXPECT_LT((resumed.status(0).state.body.p_world - whole.status(0).state.body.p_world).norm(),
            0.02);
  EXPECT_LT(resumed.summary(0).tracking_error_max, 0.2);
  EXPECT_EQ(resumed.simulated(), Duration(std::chrono::seconds(5)));
}

TEST(Simulation, WhoHasLandedIsNoWreckWhereALogEnds) {
  Scenario scenario = through_each_other();
  scenario.vehicles.resize(1);
  VehicleSetup& v = scenario.vehicles[0];
  v.mission.waypoints.clear();
  v.start.z() = 0.6;
  v.commands.resize(2);
  v.commands[0].kind = "land";
  v.commands[0].time = 0.5;
  v.commands[1].kind = "take_off";
  v.commands[1].time = 9.0;
  scenario.duration = 14.0;
  const Executor executor(1);
  Simulation whole(scenario, hall(), executor);
  ByteSink sink;
  const SimTime logged(std::chrono::seconds(8));
  whole.advance_to(logged, sink);
  ASSERT_TRUE(whole.status(0).landed);
  ASSERT_LT(whole.status(0).state.rotors[0].speed, 1.0);
  Simulation resumed(scenario, hall(), executor);
  resumed.resume_at(logged, Duration{0}, {{0, whole.status(0).state}});
  EXPECT_TRUE(resumed.status(0).landed);
  while (resumed.step(sink)) {
  }
  EXPECT_FALSE(resumed.status(0).crashed);
  EXPECT_GT(resumed.status(0).state.body.p_world.z(), 0.8);  // it has taken off again
  // nobody told this one to stop its rotors
  scenario.vehicles[0].commands.clear();
  Simulation fallen(scenario, hall(), executor);
  fallen.resume_at(logged, Duration{0}, {{0, whole.status(0).state}});
  EXPECT_TRUE(fallen.status(0).crashed);
}

}  // namespace
}  // namespace pointflight
