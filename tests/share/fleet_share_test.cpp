// Processes that share a run by their clocks: where others are, who is lost and what was missed,
// who is refused, strangers. (In lockstep: lockstep_test.cpp.)
#include "pointflight/share/fleet_share.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "pointflight/share/common_ground.hpp"
#include "tests/share/members.hpp"

namespace pointflight {
namespace {

constexpr std::int64_t kMs = 1'000'000;

using testing::Bus;
using testing::error_of;
using testing::expect_contains;
using testing::Member;
using testing::through_each_other;
using testing::with_share;
using testing::World;

TEST(FleetShare, OthersAreWhereTheyAreWithinTheBound) {
  World world;
  world.bus.delay = 2 * kMs;
  Scenario scenario = through_each_other();
  Member& a = world.add(scenario, {0});
  Member& b = world.add(scenario, {1});
  world.pass(1.5);
  double worst = 0.0;
  for (int k = 0; k < 6000; ++k) {
    world.pass(1e-3);
    const SimTime time = a.simulation.time();
    ASSERT_EQ(time, b.simulation.time());
    // where a took b to be in its last step, and where b was
    const RigidBodyState& taken = a.simulation.status(1).state.body;
    const RigidBodyState& now = b.simulation.status(1).state.body;
    worst = std::max(worst, (taken.p_world - (now.p_world - 1e-3 * now.v_world)).norm());
  }
  const auto apart = a.simulation.source_reports();
  ASSERT_EQ(apart.size(), 1u);
  EXPECT_EQ(apart[0].flown_by, "host:2");
  EXPECT_EQ(apart[0].losses, 0u);
  EXPECT_LE(apart[0].extrapolated_max, 0.0125);
  EXPECT_GT(worst, 0.0);
  EXPECT_LT(worst, apart[0].extrapolation_bound);
  EXPECT_LT(worst, 1e-3);
  // both have met the other, at the same times
  ASSERT_FALSE(a.sink.collisions.empty());
  ASSERT_EQ(a.sink.collisions.size(), b.sink.collisions.size());
  for (std::size_t i = 0; i < a.sink.collisions.size(); ++i) {
    EXPECT_NEAR(to_seconds(a.sink.collisions[i].time), to_seconds(b.sink.collisions[i].time), 2e-3);
    EXPECT_EQ(a.sink.collisions[i].partner, kFirstVehicle + 1);
  }
  for (const auto& peer : a.share->peers()) {
    ASSERT_TRUE(peer.offset);
    EXPECT_LE(std::abs(*peer.offset), peer.offset_error + 2e-3);
    EXPECT_EQ(peer.missing, 0u);
  }
}

TEST(FleetShare, WhoComesLateBeginsAtTheTimeOfTheOthers) {
  World world;
  world.bus.delay = 20 * kMs;
  const Scenario scenario = through_each_other();
  Member& a = world.add(scenario, {0});
  world.pass(4.0);
  EXPECT_GT(to_seconds(a.simulation.time()), 2.5);
  Member& b = world.add(scenario, {1});
  world.pass(1.5);
  EXPECT_NEAR(to_seconds(b.simulation.time() - a.simulation.time()), 0.0, 0.002);
  EXPECT_GT(to_seconds(b.simulation.state().skipped), 3.0);
  EXPECT_LT(to_seconds(b.simulation.simulated()), 1.0);
  EXPECT_TRUE(a.simulation.status(1).present);
  // it began at its start, with its mission
  EXPECT_LT(b.simulation.summary(1).distance_flown, 1.0);
  world.pass(4.0);  // it turns first
  EXPECT_GT(b.simulation.summary(1).distance_flown, 0.5);
  // clocks that were apart: one that began too early lets the other come up
  World later;
  later.bus.delay = 20 * kMs;
  Member& c = later.add(scenario, {0});
  later.pass(2.0);
  Member& d = later.add(scenario, {1});
  later.pass(1.5);
  c.start -= 40 * kMs;  // by 40 ms ahead
  later.pass(0.3);
  EXPECT_GT(to_seconds(c.simulation.time() - d.simulation.time()), 0.02);
  later.pass(2.0);
  EXPECT_LT(to_seconds(c.simulation.time() - d.simulation.time()),
            0.026);  // as exactly as it can know
}

TEST(FleetShare, WhoIsSilentIsLostAndWhatWasMissedIsSaidAfterwards) {
  for (const OnLoss on_loss : {OnLoss::kVanish, OnLoss::kHold}) {
    World world;
    Scenario scenario = through_each_other();
    ShareSetup setup = share_setup_of(scenario);
    setup.on_loss = on_loss;
    scenario = with_share(scenario, setup);
    Member& a = world.add(scenario, {0});
    Member& b = world.add(scenario, {1});
    world.pass(2.2);
    ASSERT_TRUE(a.simulation.status(1).present);
    world.bus.loses = [](std::size_t, std::size_t, ShareChannel) { return true; };
    world.pass(10.0);
    EXPECT_EQ(a.sink.kinds(), std::vector<std::string>({"lost"}));
    EXPECT_EQ(a.simulation.status(1).present, on_loss == OnLoss::kHold);
    const std::size_t met = a.sink.collisions.size();
    world.bus.loses = nullptr;
    world.pass(0.5);
    ASSERT_GE(a.sink.events.size(), 3u);
    EXPECT_EQ(a.sink.events.back().kind, "back");
    const VehicleEvent& missed = a.sink.events[1];
    EXPECT_EQ(missed.kind, "missed_contact");
    EXPECT_EQ(missed.vehicle, 0u);
    EXPECT_EQ(missed.partner, kFirstVehicle + 1);
    EXPECT_GT(missed.penetration, 0.0);
    for (const Member* member : {&a, &b}) {
      const SourceReport apart = member->simulation.source_reports().front();
      EXPECT_EQ(apart.losses, 1u);
      EXPECT_NEAR(to_seconds(apart.apart), 10.0, 0.2);
      EXPECT_GE(apart.missed_contacts, 1u);
      EXPECT_EQ(apart.unknown_contacts, 0u);
      EXPECT_TRUE(member->simulation.status(1).present);
    }
    world.pass(8.0);  // and they meet again
    EXPECT_GT(a.sink.collisions.size(), met);
  }
}

TEST(FleetShare, WhatIsForgottenWhenTheyMeetAgainIsUnknown) {
  if (testing::kSanitized) GTEST_SKIP() << "two minutes of flight, step by step";
  World world;
  Scenario scenario = through_each_other();
  scenario.duration = 150.0;
  for (VehicleSetup& v : scenario.vehicles) v.mission.waypoints.resize(1);  // then they hover
  Member& a = world.add(scenario, {0});
  Member& b = world.add(scenario, {1});
  world.pass(2.2);
  world.bus.loses = [](std::size_t, std::size_t, ShareChannel) { return true; };
  world.pass(130.0);  // they remember two minutes
  world.bus.loses = nullptr;
  world.pass(0.5);
  for (const Member* member : {&a, &b}) {
    EXPECT_EQ(member->simulation.source_reports().front().losses, 1u);
    EXPECT_EQ(member->simulation.source_reports().front().unknown_contacts, 1u);
  }
}

TEST(FleetShare, WhoHasStoodStillGoesOnWhereTheOthersAre) {
  World world;
  const Scenario scenario = through_each_other();
  Member& a = world.add(scenario, {0});
  Member& b = world.add(scenario, {1});
  world.pass(3.0);
  const Vector3d before = b.simulation.status(1).state.body.p_world;
  world.pass(5.0, {&b});
  EXPECT_EQ(a.sink.kinds(), std::vector<std::string>({"lost"}));
  world.pass(0.02);
  EXPECT_NEAR(to_seconds(b.simulation.time() - a.simulation.time()), 0.0, 0.002);
  EXPECT_LT((b.simulation.status(1).state.body.p_world - before).norm(), 0.1);
  world.pass(1.0);
  EXPECT_EQ(a.sink.kinds().back(), "back");
  // its mission went on as if nothing had been: the reference is near
  EXPECT_LT(b.simulation.summary(1).tracking_error_max, 0.2);
  EXPECT_TRUE(std::any_of(b.lines.begin(), b.lines.end(), [](const std::string& line) {
    return line.find("behind the others") != std::string::npos;
  }));
}

TEST(FleetShare, NobodyIsMetOnAWayThatNobodyFlew) {
  // abreast, a metre apart: whoever jumps would sweep through the other
  Scenario scenario = through_each_other();
  scenario.vehicles[0].start = {8, 5, 3};
  scenario.vehicles[1].start = {8, 6, 3};
  scenario.vehicles[0].mission.waypoints = {{16, 5, 3}, {16, 9, 3}};
  scenario.vehicles[1].mission.waypoints = {{16, 6, 3}, {16, 2, 3}};
  ShareSetup setup = share_setup_of(scenario);
  setup.on_loss = OnLoss::kHold;
  scenario = with_share(scenario, setup);
  World world;
  Member& a = world.add(scenario, {0});
  Member& b = world.add(scenario, {1});
  world.pass(3.0);
  world.pass(5.0, {&b});
  world.pass(0.5);
  EXPECT_EQ(a.sink.kinds().back(), "back");
  // b stood beside a's way, and so did what a took it for
  EXPECT_TRUE(a.sink.collisions.empty());
  EXPECT_TRUE(b.sink.collisions.empty());
}

TEST(FleetShare, WhoIsStartedAgainBeforeItsLeaseHasRunOutIsTakenThen) {
  World world;
  const Scenario scenario = through_each_other();
  Member& a = world.add(scenario, {0});
  Member& b = world.add(scenario, {1});
  world.pass(3.0);
  // killed: it says nothing more, not even that it goes
  world.bus.loses = [](std::size_t from, std::size_t, ShareChannel) { return from == 1; };
  world.bus.forget(1);
  world.pass(0.1, {&b});
  Member& again = world.add(scenario, {1});
  world.pass(2.0, {&b});
  EXPECT_EQ(a.sink.kinds(), std::vector<std::string>({"lost", "back"}));
  EXPECT_TRUE(a.simulation.status(1).present);
  EXPECT_EQ(a.simulation.source_reports().front().flown_by, "host:3");
  EXPECT_EQ(a.simulation.source_reports().front().unknown_contacts, 1u);
  EXPECT_TRUE(again.simulation.status(0).present);
}

TEST(FleetShare, WhoLeavesIsGoneAtOnce) {
  World world;
  Member& a = world.add(through_each_other(), {0});
  Member& b = world.add(through_each_other(), {1});
  world.pass(3.0);
  b.share->leave();
  world.pass(0.01, {&b});
  EXPECT_EQ(a.sink.kinds(), std::vector<std::string>({"left"}));
  EXPECT_FALSE(a.simulation.status(1).present);
  EXPECT_EQ(a.simulation.source_reports().front().losses, 0u);
}

TEST(FleetShare, WhoDoesNotFitIsRefusedOrLeftOut) {
  World world;
  Member& a = world.add(through_each_other(), {0});
  world.pass(2.0);
  const auto joins = [&](const Scenario& scenario, std::vector<std::size_t> vehicles) {
    return error_of([&] {
      world.add(scenario, std::move(vehicles));
      world.pass(2.0);
    });
  };
  Scenario other = through_each_other();
  expect_contains(joins(other, {0, 1}), "--share test: host:1 flies a (vehicle 0) too");
  world.members.pop_back();
  other.seed = 7;
  expect_contains(joins(other, {1}), "another seed (1 there, 7 here)");
  world.members.pop_back();
  other = through_each_other();
  other.vehicles[1].mission.yaw_rate_deg = 45.0;
  expect_contains(joins(other, {1}), "another scenario");
  world.members.pop_back();
  other = through_each_other();
  other.vehicles[1].model = "quad_250";
  expect_contains(joins(other, {1}), "another set of vehicles or sensors");
  world.members.pop_back();
  // what a process writes and where its files lie does not matter
  other = through_each_other();
  other.output.scans = false;
  other.path = "elsewhere/t.yaml";
  Member& b = world.add(other, {1});
  world.pass(2.0);
  EXPECT_TRUE(a.simulation.status(1).present);
  EXPECT_TRUE(a.share->fault().empty() && b.share->fault().empty());
}

TEST(FleetShare, OfTwoThatFlyOneVehicleTheYoungerGivesWay) {
  World world;
  world.bus.loses = [](std::size_t, std::size_t, ShareChannel) { return true; };
  Member& a = world.add(through_each_other(), {0});
  Member& b = world.add(through_each_other(), {0, 1});
  world.pass(2.0);
  EXPECT_TRUE(a.start > 0 && b.start > 0);
  world.bus.loses = nullptr;
  world.bus.tell_crew();
  world.pass(0.1);
  EXPECT_TRUE(a.share->fault().empty());
  expect_contains(b.share->fault(), "--share test: host:1 flies a (vehicle 0) too");
  EXPECT_TRUE(b.link->is_over());
  EXPECT_FALSE(a.link->is_over());
}

}  // namespace
}  // namespace pointflight
