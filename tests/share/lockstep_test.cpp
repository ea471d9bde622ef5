// Processes that share a run step by step: the bytes of one process, however it is divided.
#include <gtest/gtest.h>

#include <atomic>
#include <thread>

#include "tests/share/members.hpp"

namespace pointflight {
namespace {

using testing::Bus;
using testing::hall;
using testing::Member;
using testing::PerVehicle;
using testing::with_share;

std::int64_t wall() {
  return std::chrono::steady_clock::now().time_since_epoch().count();
}

/// Three that fly past each other among obstacles.
Scenario three(ShareTime time) {
  Scenario s;
  s.path = "s.yaml";
  s.duration = testing::kSanitized ? 0.25 : 1.2;
  s.vehicles.resize(3);
  for (std::size_t i = 0; i < 3; ++i) {
    VehicleSetup& v = s.vehicles[i];
    v.start = {6.0 + 1.5 * static_cast<double>(i), 6, 3};
    v.mission.waypoints = {{6.0 + 1.5 * static_cast<double>(i), 9, 3}};
    v.lidars.front().model = i == 1 ? "mid360" : "marsim_grid";
    v.name = std::string(1, static_cast<char>('a' + i));
  }
  s.vehicles[1].start.y() = 8.0;
  s.vehicles[1].mission.waypoints = {{6.4, 4, 3}};
  ObstacleSettings balls;
  balls.count = 10;
  balls.size.radius = 0.2;
  balls.speed = 1.0;
  s.obstacles = {balls};
  ShareSetup setup;
  setup.time = time;
  return with_share(s, setup);
}

/// In lockstep, a thread each.
std::vector<std::unique_ptr<Member>> fly_in_step(const Scenario& scenario,
                                                 const std::vector<std::vector<std::size_t>>& who) {
  Bus bus(wall);
  std::vector<std::unique_ptr<Member>> members;
  for (const auto& vehicles : who) {
    members.push_back(std::make_unique<Member>(bus, scenario, vehicles, wall, members.size() + 1));
  }
  std::vector<std::thread> threads;
  for (const auto& member : members) {
    threads.emplace_back([&m = *member] {
      while (!m.link->is_ready()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
      while (m.simulation.step(m.sink)) m.obey_share();
      m.share->leave();
    });
  }
  for (std::thread& thread : threads) thread.join();
  return members;
}

PerVehicle fly_alone(const Scenario& scenario, RunEnd& end, SimTime& time) {
  const Executor executor(2);
  Simulation simulation(scenario, hall(), executor);
  PerVehicle sink;
  while (simulation.step(sink)) {
  }
  end = simulation.end();
  time = simulation.time();
  return sink;
}

void expect_as_one_process(const Scenario& scenario,
                           const std::vector<std::vector<std::size_t>>& who) {
  RunEnd end{};
  SimTime time;
  const PerVehicle alone = fly_alone(scenario, end, time);
  for (const auto& member : fly_in_step(scenario, who)) {
    EXPECT_EQ(member->simulation.end(), end);
    EXPECT_EQ(member->simulation.time(), time);
    for (const auto& [vehicle, sink] : member->sink.sinks) {
      EXPECT_TRUE(member->simulation.flies_here(vehicle));
      EXPECT_EQ(sink.hash(), alone.sinks.at(vehicle).hash()) << vehicle;
    }
    EXPECT_EQ(member->sink.sinks.size(), member->simulation.flying_here().size());
    for (const VehicleEvent& event : member->sink.events) {
      EXPECT_TRUE(member->simulation.flies_here(event.vehicle))
          << event.kind << ": " << event.words;
    }
  }
}

TEST(FleetShare, Slow_LockstepGivesTheBytesOfOneProcess) {
  const Scenario scenario = three(ShareTime::kLockstep);
  RunEnd end{};
  SimTime time;
  PerVehicle alone = fly_alone(scenario, end, time);
  int seen = 0;  // else nothing is shown
  for (auto& [vehicle, sink] : alone.sinks) {
    for (Label label = 1; label <= 3; ++label) seen += sink.labels[label];
  }
  EXPECT_GT(seen, 100);
  expect_as_one_process(scenario, {{0}, {1}, {2}});
  expect_as_one_process(scenario, {{0, 2}, {1}});
}

TEST(FleetShare, LockstepEndsForAllAtOnce) {
  Scenario scenario = three(ShareTime::kLockstep);
  scenario.duration = 0.0;
  scenario.obstacles.clear();
  for (VehicleSetup& v : scenario.vehicles) v.lidars.clear();
  scenario.vehicles[1].start = {6, 11, 3};
  scenario.vehicles[1].mission.waypoints = {{4.6, 12, 3}};  // into a pillar at (5, 12)
  scenario.vehicles[1].on_collision = CollisionReaction::kStop;
  expect_as_one_process(scenario, {{0}, {1}, {2}});
  scenario.vehicles[1].on_collision =
      CollisionReaction::kCrash;  // the mission is not finished then
  expect_as_one_process(scenario, {{1}, {0, 2}});
  scenario.vehicles[1].mission.waypoints = {{7, 10, 3}};
  expect_as_one_process(scenario, {{0, 1}, {2}});
}

TEST(FleetShare, LockstepGoesOnWithoutWhoIsLostAndTakesItBack) {
  Scenario scenario = three(ShareTime::kLockstep);
  scenario.obstacles.clear();
  for (VehicleSetup& v : scenario.vehicles) v.lidars.clear();
  scenario.duration = 1.5;
  Bus bus(wall);
  std::atomic<bool> cut = false;
  bus.loses = [&cut](std::size_t from, std::size_t to, ShareChannel) {
    return cut && (from == 2) != (to == 2);
  };
  std::vector<std::unique_ptr<Member>> members;
  for (std::size_t i = 0; i < 3; ++i) {
    members.push_back(std::make_unique<Member>(bus, scenario, std::vector{i}, wall, i + 1));
  }
  std::atomic<std::int64_t> reached[3] = {};
  std::vector<std::thread> threads;
  for (std::size_t i = 0; i < 3; ++i) {
    threads.emplace_back([&, i, &m = *members[i]] {
      while (!m.link->is_ready()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
      while (m.simulation.step(m.sink)) {
        m.obey_share();
        reached[i] = m.simulation.time().time_since_epoch().count();
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
        // the third one is slower, alone
        while (i == 2 && cut && reached[0] < reached[2] + 200'000'000) std::this_thread::yield();
      }
      m.share->leave();
    });
  }
  const auto wait_for = [&](std::size_t member, double seconds) {
    while (reached[member] < std::llround(1e9 * seconds)) std::this_thread::yield();
  };
  wait_for(2, 0.3);
  cut = true;
  for (const std::size_t i : {0, 1}) {
    bus.lose(2, i);
    bus.lose(i, 2);
  }
  wait_for(0, 0.8);
  cut = false;
  bus.tell_crew();
  for (std::thread& thread : threads) thread.join();
  for (const auto& member : members) {
    EXPECT_EQ(to_seconds(member->simulation.time()), 1.5);
    EXPECT_EQ(member->simulation.end(), RunEnd::kMissionUnfinished);
    const auto kinds = member->sink.kinds();
    EXPECT_EQ(std::count(kinds.begin(), kinds.end(), "lost"), member == members[2] ? 2 : 1);
    EXPECT_EQ(std::count(kinds.begin(), kinds.end(), "back"), member == members[2] ? 2 : 1);
    for (const SourceReport& other : member->simulation.source_reports()) {
      EXPECT_EQ(other.losses, member == members[2] || other.vehicle == 2 ? 1u : 0u);
      EXPECT_EQ(other.unknown_contacts, 0u);  // they have told each other where they were
    }
  }
  // the one that was slower has jumped to where the others were
  EXPECT_GT(to_seconds(members[2]->simulation.state().skipped), 0.05);
  EXPECT_EQ(members[0]->simulation.state().skipped, Duration{0});
}

/// Two of whom one does not get something of the other's from 0.2 s on; both to their ends.
std::vector<std::unique_ptr<Member>> fly_half_deaf(
    Bus& bus, const std::function<bool(ShareChannel)>& is_lost) {
  Scenario scenario = three(ShareTime::kLockstep);
  scenario.obstacles.clear();
  scenario.vehicles.pop_back();
  for (VehicleSetup& v : scenario.vehicles) v.lidars.clear();
  scenario.duration = 0.6;
  ShareSetup setup;
  setup.time = ShareTime::kLockstep;
  setup.lease = 0.2;
  scenario = with_share(scenario, setup);
  std::atomic<bool> broken = false;
  bus.loses = [&broken, is_lost](std::size_t from, std::size_t /*to*/, ShareChannel channel) {
    return broken && from == 0 && is_lost(channel);
  };
  std::vector<std::unique_ptr<Member>> members;
  for (std::size_t i = 0; i < 2; ++i) {
    members.push_back(std::make_unique<Member>(bus, scenario, std::vector{i}, wall, i + 1));
  }
  std::vector<std::thread> threads;
  for (const auto& member : members) {
    threads.emplace_back([&m = *member, &broken] {
      while (!m.link->is_ready()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
      while (m.simulation.step(m.sink)) {
        m.obey_share();
        if (m.simulation.time() >= SimTime(std::chrono::milliseconds(200))) broken = true;
      }
      m.share->leave();
    });
  }
  for (std::thread& thread : threads) thread.join();
  bus.loses = nullptr;
  return members;
}

// Packets that somebody changes and sends once more make DDS take the right ones for old, for good.
TEST(FleetShare, LockstepDoesNotWaitForStepsThatNeverCome) {
  struct Case {
    std::function<bool(ShareChannel)> is_lost;
    const char* words;
  };
  const Case cases[] = {
      {[](ShareChannel channel) { return channel == ShareChannel::kStates; },
       "is heard, but its steps do not come"},
      {[](ShareChannel) { return true; }, "has said nothing for 0.6 s"},
  };
  for (const Case& c : cases) {
    Bus bus(wall);
    const auto members = fly_half_deaf(bus, c.is_lost);
    for (const auto& member : members) {
      EXPECT_EQ(member->simulation.time(), SimTime(std::chrono::milliseconds(600)));
    }
    // the deaf one says so
    const auto& events = members[1]->sink.events;
    const auto lost = std::find_if(
        events.begin(), events.end(), [](const VehicleEvent& e) { return e.kind == "lost"; });
    ASSERT_NE(lost, events.end()) << c.words;
    testing::expect_contains(lost->words, c.words);
  }
}

TEST(FleetShare, LockstepThatGoesOnFromALogWaitsForTheOthersAsAnyDoes) {
  Scenario scenario = three(ShareTime::kLockstep);
  scenario.obstacles.clear();
  for (VehicleSetup& v : scenario.vehicles) v.lidars.clear();
  std::int64_t now = 1'000'000'000;
  const auto clock = [&now] { return now; };
  Bus bus(clock);
  Member a(bus, scenario, {0, 1}, clock, 1);
  const auto is_ready_within = [&](Member& member, double seconds) {
    for (const std::int64_t end = now + std::llround(1e9 * seconds); now < end; now += 10'000'000) {
      if (member.link->is_ready()) return true;
    }
    return false;
  };
  a.simulation.resume_at(SimTime(std::chrono::milliseconds(500)), Duration{0}, {});
  EXPECT_FALSE(is_ready_within(a, 5.0));
  ASSERT_FALSE(a.lines.empty());
  EXPECT_EQ(a.lines.back(), "--share test: waiting for a process that flies c");
  Member b(bus, scenario, {2}, clock, 2);
  EXPECT_TRUE(is_ready_within(b, 0.1));
  EXPECT_TRUE(is_ready_within(a, 0.1));
}

TEST(FleetShare, StepsAheadComeOutTheSameEachTime) {
  Scenario scenario = three(ShareTime::kLockstep);
  ShareSetup setup;
  setup.time = ShareTime::kLockstep;
  setup.ahead = 8;
  scenario = with_share(scenario, setup);
  std::map<std::size_t, std::uint64_t> first;
  for (int k = 0; k < 2; ++k) {
    for (const auto& member : fly_in_step(scenario, {{0}, {1}, {2}})) {
      for (const auto& [vehicle, sink] : member->sink.sinks) {
        if (k == 0) first[vehicle] = sink.hash();
        EXPECT_EQ(sink.hash(), first[vehicle]);
      }
    }
  }
  RunEnd end{};
  SimTime time;
  const PerVehicle alone = fly_alone(scenario, end, time);
  EXPECT_NE(alone.sinks.at(0).hash(), first[0]);
}

}  // namespace
}  // namespace pointflight
