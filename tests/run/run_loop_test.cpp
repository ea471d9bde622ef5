// Runs: what links see and what they may ask for, without a clock that matters.
#include "pointflight/run/run_loop.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <stdexcept>
#include <thread>

#include "pointflight/run/threaded_link.hpp"
#include "tests/sim/runs.hpp"

namespace pointflight {
namespace {

using testing::ByteSink;
using testing::hall;
using testing::hovering;

Scenario short_run() {
  Scenario scenario = hovering();
  scenario.duration = 0.5;
  scenario.vehicles[0].lidars = {LidarMount{}};
  return scenario;
}

/// Notes what comes; asks for what it is told to at the steps it is told.
class Probe : public Link {
 public:
  void open(const RunDescription& /*run*/) override { calls += "open "; }
  bool is_ready() override { return ready_after-- <= 0; }
  void on_sample(const Sample& sample) override {
    bytes.on_sample(sample);
    scans += std::holds_alternative<ScanSample>(sample) ? 1 : 0;
    if (failing) throw std::runtime_error("no room");
  }
  void on_step(const StepDone& step) override {
    ++steps;
    last = step.time;
  }
  void on_wait(SimTime now, Waiting why) override {
    ++waits[static_cast<std::size_t>(why)];
    if (why == Waiting::kPaused) paused_at = now;
  }
  std::vector<Order> take_orders() override {
    std::vector<Order> taken;
    while (!orders.empty() && orders.front().first <= steps + idle) {
      taken.push_back(orders.front().second);
      orders.erase(orders.begin());
    }
    ++idle;
    return taken;
  }
  void on_rejected(const VehicleOrder& /*order*/, const std::string& why) override {
    rejected = why;
  }
  void on_reset(SimTime reached) override {
    calls += "reset ";
    reset_at = reached;
    bytes = ByteSink();
  }
  void close() override { calls += "close"; }
  [[nodiscard]] bool is_in_use() const override { return used; }

  ByteSink bytes;
  std::string calls, rejected;
  std::array<int, 3> waits{};
  std::vector<std::pair<int, Order>> orders;  ///< After so many looks.
  int ready_after = 0;
  int steps = 0;
  int idle = 0;
  std::atomic<int> scans = 0;  ///< Orders are taken on the run's thread, samples on the link's.
  SimTime last, paused_at, reset_at;
  bool used = true;
  bool failing = false;
};

TEST(RunLoop, ALinkSeesWhatAProgramThatStepsSees) {
  const Executor executor(2);
  ByteSink stepped;
  const RunEnd end = testing::run(short_run(), stepped, executor).end();
  Simulation simulation(short_run(), hall(), executor);
  Probe link;
  link.ready_after = 2;
  RunLoop loop(simulation, {});
  loop.add(link);
  EXPECT_EQ(loop.run(), end);
  EXPECT_EQ(link.bytes.hash(), stepped.hash());
  EXPECT_EQ(link.calls, "open close");
  EXPECT_EQ(link.waits[static_cast<std::size_t>(Waiting::kForLinks)], 2);
  EXPECT_EQ(link.steps, 501);
  EXPECT_EQ(link.scans, 5);
  EXPECT_TRUE(loop.has_started());
}

TEST(RunLoop, ObeysOrdersBetweenSteps) {
  const Executor executor(2);
  Simulation simulation(short_run(), hall(), executor);
  Probe link;
  VelocityCommand up;
  up.v_world = {0, 0, 0.5};
  // every look is a step, or one while it waits
  link.orders = {{100, VehicleOrder{0, up}},
                 {200, VehicleOrder{0, RotorSpeedCommand{{1.0}}}},
                 {300, PauseOrder{true}},
                 {340, StepOrder{}},
                 {500, PauseOrder{false}},
                 {700, ResetOrder{}}};
  std::vector<std::string> lines;
  RunOptions options;
  options.log = [&](const std::string& line) { lines.push_back(line); };
  RunLoop loop(simulation, options);
  loop.add(link);
  loop.run();
  EXPECT_NE(link.rejected.find("1 rotor speeds for a vehicle with"), std::string::npos);
  EXPECT_EQ(link.calls, "open reset close");
  EXPECT_GT(link.waits[static_cast<std::size_t>(Waiting::kPaused)], 10);
  EXPECT_GT(link.reset_at, link.paused_at);
  ASSERT_GE(lines.size(), 4u);
  EXPECT_NE(lines[0].find("rotor speeds"), std::string::npos);
  EXPECT_EQ(lines[1], "paused");
  EXPECT_EQ(lines[2], "going on");
  // from the start again: as if nothing had been
  ByteSink untouched;
  testing::run(short_run(), untouched, executor);
  EXPECT_EQ(link.bytes.hash(), untouched.hash());
  // what it cost is of all that was simulated
  EXPECT_DOUBLE_EQ(
      loop.simulated(),
      to_seconds(link.reset_at.time_since_epoch() + simulation.time().time_since_epoch()));
  const auto costs = lidar_costs(simulation);
  ASSERT_EQ(costs.size(), 1u);
  EXPECT_EQ(costs[0].model, "mid360");
  EXPECT_EQ(costs[0].count, 1u);
  EXPECT_GT(costs[0].rendering, 0.0);
  EXPECT_GT(costs[0].cpu_time, costs[0].rendering);
  const ScanCost scan = measure_scan(simulation, 0, 0);
  EXPECT_GT(scan.as_is, 0.0);
  EXPECT_GT(scan.as_lines, 0.0);
}

/// Wants to answer each scan, and never does.
class Asked : public Probe {
 public:
  [[nodiscard]] bool wants_answer(const Sample& sample) const override {
    return std::holds_alternative<ScanSample>(sample);
  }
};

/// Answers each scan.
class AnsweringPlanner : public Asked {
 public:
  std::vector<Order> take_orders() override {
    if (scans == answered) return {};
    answered = scans;
    return {VehicleOrder{0, HoverCommand{}, true}};
  }
  int answered = 0;
};

TEST(RunLoop, LockstepWaitsForAnswers) {
  const Executor executor(2);
  RunOptions options;
  options.lockstep = 0.002;
  Simulation silent(short_run(), hall(), executor);
  Asked nobody;
  RunLoop alone(silent, options);
  alone.add(nobody);
  alone.run();
  EXPECT_EQ(alone.unanswered(), 5u);
  // one that answers each scan is waited for no longer; beside it one that answers each IMU sample
  // and commands nothing
  AnsweringPlanner planner;
  class Controller : public Probe {
   public:
    void on_sample(const Sample& sample) override {
      Probe::on_sample(sample);
      asked += wants_answer(sample) ? 1 : 0;
    }
    [[nodiscard]] bool wants_answer(const Sample& sample) const override {
      return std::holds_alternative<ImuSample>(sample);
    }
    void on_wait(SimTime now, Waiting why) override {
      Probe::on_wait(now, why);
      EXPECT_EQ(asked, answered + 1) << "the run went on before the last one was answered";
    }
    std::vector<Order> take_orders() override {
      if (asked == answered || ++looks % 3 != 0) return {};
      answered = asked;
      return {AnswerOrder{}};
    }
    int asked = 0, answered = 0, looks = 0;
  } controller;
  options.lockstep = 60.0;
  Simulation flown(short_run(), hall(), executor);
  RunLoop loop(flown, options);
  loop.add(planner);
  loop.add(controller);
  loop.run();
  EXPECT_EQ(planner.answered, 5);
  EXPECT_GT(controller.asked, 80);
  EXPECT_EQ(controller.answered, controller.asked);
  EXPECT_EQ(loop.unanswered(), 0u);
}

TEST(RunLoop, EndsWhereNobodyIsLeftOrSomebodyWantsIt) {
  const Executor executor(2);
  Simulation unused(short_run(), hall(), executor);
  Probe gone;
  gone.used = false;
  RunLoop loop(unused, {});
  loop.add(gone);
  EXPECT_EQ(loop.run(), RunEnd::kInterrupted);
  EXPECT_FALSE(loop.has_started());
  EXPECT_EQ(gone.calls, "open ");

  Simulation ended(short_run(), hall(), executor);
  Probe link;
  link.orders = {{50, EndOrder{}}};
  RunLoop other(ended, {});
  other.add(link);
  EXPECT_EQ(other.run(), RunEnd::kInterrupted);
  EXPECT_LT(link.steps, 60);
  EXPECT_EQ(link.calls, "open close");
}

TEST(RunLoop, EndsWhilePausedAndAfterAReset) {
  const Executor executor(1);
  for (const std::vector<std::pair<int, Order>>& orders :
       {std::vector<std::pair<int, Order>>{{20, PauseOrder{true}}, {40, EndOrder{}}},
        std::vector<std::pair<int, Order>>{{20, EndOrder{}}, {20, ResetOrder{}}}}) {
    Simulation simulation(short_run(), hall(), executor);
    Probe link;
    link.orders = orders;
    RunLoop loop(simulation, {});
    loop.add(link);
    EXPECT_EQ(loop.run(), RunEnd::kInterrupted);
    EXPECT_LT(link.steps, 60);
  }
}

TEST(RunLoop, ClosesAllLinksWhereOneCannotBeClosed) {
  const Executor executor(1);
  class Full : public Link {
    void close() override { throw std::runtime_error("no room"); }
  } full;
  Simulation simulation(short_run(), hall(), executor);
  Probe other;
  RunLoop loop(simulation, {});
  loop.add(full);
  loop.add(other);
  EXPECT_THROW(loop.run(), std::runtime_error);
  EXPECT_EQ(other.calls, "open close");
}

TEST(ThreadedLink, HandsOverEverythingInOrder) {
  const Executor executor(2);
  ByteSink stepped;
  testing::run(short_run(), stepped, executor);
  Simulation simulation(short_run(), hall(), executor);
  Probe slow;
  ThreadedLink link(slow, {.capacity = 3, .hold = std::chrono::milliseconds(1)});
  RunLoop loop(simulation, {});
  loop.add(link);
  loop.run();
  EXPECT_EQ(slow.bytes.hash(), stepped.hash());
  EXPECT_EQ(slow.calls, "open close");
  EXPECT_EQ(loop.dropped(), 0u);
  EXPECT_THROW(ThreadedLink(slow, {.capacity = 0}), std::invalid_argument);
}

TEST(ThreadedLink, DropsTheOldestForThoseWhoAreSlow) {
  const Executor executor(2);
  /// Stands still until the run has ended.
  class Stuck : public Probe {
   public:
    void on_sample(const Sample& sample) override {
      while (!go) std::this_thread::yield();
      Probe::on_sample(sample);
      ++taken;
    }
    std::atomic<bool> go = false;
    int taken = 0;
  } stuck;
  ThreadedLink link(stuck, {.capacity = 10, .when_full = ThreadedLink::WhenFull::kDropOldest});
  class Release : public Probe {
   public:
    explicit Release(Stuck& stuck) : stuck_(stuck) {}
    void close() override { stuck_.go = true; }
    void on_sample(const Sample& /*sample*/) override { ++samples; }
    int samples = 0;

   private:
    Stuck& stuck_;
  } release(stuck);
  Simulation simulation(short_run(), hall(), executor);
  RunLoop loop(simulation, {});
  loop.add(release);
  loop.add(link);
  loop.run();
  EXPECT_LE(stuck.taken, 12);
  EXPECT_LE(stuck.steps, 14) << "steps are merged where samples between them went";
  EXPECT_EQ(loop.dropped() + static_cast<std::uint64_t>(stuck.taken),
            static_cast<std::uint64_t>(release.samples));
}

TEST(ThreadedLink, WhatItsLinkThrowsEndsTheRun) {
  const Executor executor(2);
  Simulation simulation(short_run(), hall(), executor);
  Probe failing;
  failing.failing = true;
  ThreadedLink link(failing, {.capacity = 4});
  RunLoop loop(simulation, {});
  loop.add(link);
  EXPECT_THROW(loop.run(), std::runtime_error);
}

/// A state of the first vehicle.
StateSample state_at(int ms) {
  StateSample sample;
  sample.time = SimTime(std::chrono::milliseconds(ms));
  return sample;
}

TEST(ThreadedLink, DoesNotEndAsWholeWhatFailed) {
  Probe failing;
  failing.failing = true;
  ThreadedLink link(failing, {.hold = std::chrono::hours(1)});
  link.open({});
  ASSERT_TRUE(link.is_ready());
  link.on_sample(state_at(0));
  EXPECT_THROW(link.close(), std::runtime_error);
  EXPECT_EQ(failing.calls, "open ") << "its files must not appear";
}

TEST(ThreadedLink, AResetWaitsUntilAllIsTaken) {
  class Slow : public Probe {
   public:
    void on_sample(const Sample& sample) override {
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
      Probe::on_sample(sample);
      ++taken;
    }
    std::atomic<int> taken = 0;
  } slow;
  ThreadedLink link(slow, {});
  link.open({});
  ASSERT_TRUE(link.is_ready());
  for (int ms = 0; ms < 20; ++ms) {
    link.on_sample(state_at(ms));
    link.on_step({SimTime(std::chrono::milliseconds(ms + 1)), 0.0, 0});
  }
  const SimTime reached{std::chrono::milliseconds(20)};
  link.on_reset(reached);
  EXPECT_EQ(slow.taken, 20);
  EXPECT_EQ(slow.calls, "open reset ");
  EXPECT_EQ(slow.reset_at, reached);
  link.close();
}

TEST(ThreadedLink, HoldsStepsBackUntilAScan) {
  class Counting : public Probe {
   public:
    void on_sample(const Sample& sample) override {
      Probe::on_sample(sample);
      ++taken;
    }
    std::atomic<int> taken = 0;
  } counting;
  ThreadedLink link(counting, {.hold = std::chrono::hours(1)});
  link.open({});
  ASSERT_TRUE(link.is_ready());
  const auto step = [&](int ms) {
    link.on_sample(state_at(ms));
    link.on_step({SimTime(std::chrono::milliseconds(ms + 1)), 0.0, 0});
  };
  step(0);  // the first is handed over: nothing was before
  for (int ms = 1; ms < 10; ++ms) step(ms);
  EXPECT_LE(counting.taken, 1);
  auto scan = std::make_shared<Scan>();
  scan->end = SimTime(std::chrono::milliseconds(10));
  link.on_sample(ScanSample{std::move(scan), PoseTrack({{SimTime{}, Pose{}}})});
  link.on_step({SimTime(std::chrono::milliseconds(10)), 0.0, 1});
  while (counting.taken < 11) std::this_thread::yield();  // else the test does not end
  step(10);
  link.close();
  EXPECT_EQ(counting.taken, 12) << "what was held back at the end";
}

TEST(ThreadedLink, LockstepWaitsForItsAnswers) {
  const Executor executor(2);
  AnsweringPlanner planner;
  ThreadedLink link(planner, {.hold = std::chrono::hours(1)});
  Simulation simulation(short_run(), hall(), executor);
  RunOptions options;
  options.lockstep = 60.0;
  RunLoop loop(simulation, options);
  loop.add(link);
  loop.run();
  EXPECT_EQ(loop.unanswered(), 0u);
  EXPECT_EQ(planner.answered, 5);
}

}  // namespace
}  // namespace pointflight
