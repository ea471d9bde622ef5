// What strangers and liars on the network can do to a shared run.
#include <gtest/gtest.h>

#include <limits>

#include "pointflight/share/common_ground.hpp"
#include "pointflight/share/fleet_share.hpp"
#include "tests/share/members.hpp"

namespace pointflight {
namespace {

using testing::World;

using testing::Bus;
using testing::Member;
using testing::through_each_other;

TEST(FleetShare, StrangersChangeNothingAndAreSaidOnce) {
  std::uint64_t hashes[2] = {};
  for (const bool disturbed : {false, true}) {
    World world;
    Member& a = world.add(through_each_other(), {0});
    Member& b = world.add(through_each_other(), {1});
    for (int k = 0; k < 5000; ++k) {
      world.pass(1e-3);
      if (!disturbed || k % 5 != 0) continue;
      const auto channel = static_cast<ShareChannel>(k / 5 % 4);
      std::vector<std::byte> bytes(static_cast<std::size_t>(k % 97));
      for (std::size_t i = 0; i < bytes.size(); ++i) bytes[i] = static_cast<std::byte>(i * 37 + k);
      world.bus.shout(channel, bytes.empty() ? std::vector<std::byte>(1) : bytes);
      share_msg::States states;  // of somebody that nobody knows, and of another version
      states.head.kind = share_msg::Kind::kStates;
      states.head.process = 4711;
      states.vehicles.resize(1);
      states.vehicles[0].number = 1;
      world.bus.shout(ShareChannel::kStates, encode<Wire::kCdr>(states));
      states.head.version = 99;
      world.bus.shout(ShareChannel::kStates, encode<Wire::kCdr>(states));
      share_msg::Introduction intro;
      intro.head.process = 4712;
      intro.vehicles = {1};
      intro.name = "another\nworld";
      intro.phase = share_msg::Phase::kFlying;
      intro.parts = {{"map", "x"}};
      world.bus.shout(ShareChannel::kMembers, encode<Wire::kCdr>(intro));
      // in the other's name, with what no vehicle does
      states.head.version = share_msg::Head::VERSION;
      states.head.process = 2;
      states.time = a.simulation.time().time_since_epoch().count();
      states.vehicles[0].position = {std::numeric_limits<double>::quiet_NaN(), 0, 0};
      world.bus.shout(ShareChannel::kStates, encode<Wire::kCdr>(states));
    }
    hashes[disturbed ? 1 : 0] = a.sink.sinks[0].hash() ^ b.sink.sinks[1].hash();
    if (!disturbed) continue;
    EXPECT_GT(a.share->foreign(), 500u);
    EXPECT_LE(a.lines.size(), 8u) << a.lines.back();
    for (const std::string& line : a.lines) EXPECT_EQ(line.find('\n'), std::string::npos);
  }
  EXPECT_EQ(hashes[0], hashes[1]);
}

TEST(FleetShare, AFloodIsReadOnlySoFar) {
  World world;
  Member& a = world.add(through_each_other(), {0});
  world.pass(0.5);
  const std::vector<std::byte> junk(50);
  for (int k = 0; k < 5000; ++k) {
    world.bus.shout(ShareChannel::kStates, junk);
    if (k % 10 == 0) world.pass(1e-3);
  }
  EXPECT_GE(a.share->foreign(), 1000u);
  EXPECT_LE(a.share->foreign(), 1010u);
  const std::string said = a.lines.back();
  testing::expect_contains(said, "1000 messages of that kind came from one program");
}

TEST(FleetShare, WhoSpeaksInAnothersNameIsNotHeardAndNoNumberIsTooLarge) {
  World world;
  Member& a = world.add(through_each_other(), {0});
  Member& b = world.add(through_each_other(), {1});
  world.pass(3.0);
  share_msg::Introduction left;
  left.head.process = 2;
  left.phase = share_msg::Phase::kLeft;
  left.vehicles = {1};
  left.parts = common_ground(a.simulation, 1.0);
  world.bus.shout(ShareChannel::kMembers, encode<Wire::kCdr>(left));
  share_msg::States states;
  states.head.kind = share_msg::Kind::kStates;
  states.head.process = 2;
  states.time = a.simulation.time().time_since_epoch().count();
  states.vehicles.resize(1);
  states.vehicles[0].number = 1;
  world.bus.shout(ShareChannel::kStates, encode<Wire::kCdr>(states));
  world.pass(0.1);
  EXPECT_TRUE(a.sink.events.empty());
  EXPECT_LT((a.simulation.status(1).state.body.p_world - b.simulation.status(1).state.body.p_world)
                .norm(),
            0.01);
  // the process itself, with less in its introduction than it said at first
  left.phase = share_msg::Phase::kFlying;
  left.parts.clear();
  const std::uint64_t foreign = a.share->foreign();
  world.bus.shout(ShareChannel::kMembers, encode<Wire::kCdr>(left), 1);
  world.pass(0.1);
  EXPECT_EQ(a.share->foreign(), foreign + 1);
  EXPECT_TRUE(a.simulation.status(1).present);
  // out of its mind
  constexpr std::int64_t kEnds[] = {std::numeric_limits<std::int64_t>::max(),
                                    std::numeric_limits<std::int64_t>::min()};
  for (const std::int64_t end : kEnds) {
    states.time = states.end_time = end;
    world.bus.shout(ShareChannel::kStates, encode<Wire::kCdr>(states), 1);
    share_msg::Clock clock;
    clock.head.kind = share_msg::Kind::kClock;
    clock.head.process = 2;
    clock.sent = clock.clock = end;
    clock.echoes = {{1, end, end}, {1, kEnds[end < 0 ? 0 : 1], 0}};
    world.bus.shout(ShareChannel::kClock, encode<Wire::kCdr>(clock), 1);
    clock.clock = 0;
    world.bus.shout(ShareChannel::kClock, encode<Wire::kCdr>(clock), 1);
    left.ends_at = left.begins_at = left.waits_at = end;
    left.vehicles = {4000000000u};
    world.bus.shout(ShareChannel::kMembers, encode<Wire::kCdr>(left), 1);
    share_msg::Past past;
    past.head.kind = share_msg::Kind::kPast;
    past.head.process = 2;
    past.to = 1;
    past.states = {{end, states.vehicles[0]}, {0, {}}};
    past.states[1].state.number = 77;
    world.bus.shout(ShareChannel::kPast, encode<Wire::kCdr>(past), 1);
  }
  world.pass(1.0);
  EXPECT_TRUE(a.sink.events.empty());
  EXPECT_TRUE(a.simulation.status(1).present);
  EXPECT_NEAR(to_seconds(a.simulation.time() - b.simulation.time()), 0.0, 0.002);
}

}  // namespace
}  // namespace pointflight
