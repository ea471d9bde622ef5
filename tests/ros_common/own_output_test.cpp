// Kinds of messages, in and out, that a program adds.
#include <gtest/gtest.h>

#include "pointflight/ros/common/bridge.hpp"
#include "pointflight/ros/common/inputs.hpp"
#include "tests/sim/runs.hpp"

namespace pointflight {
namespace {

using testing::error_of;
using testing::expect_contains;
using testing::hall;
using testing::hovering;

msg::PoseStamped place_of(const OutputStream& stream, const StateSample& sample) {
  return {stream.header(sample.time), pose_of(sample.state.body.T_world_body())};
}

std::optional<Order> to_height(const msg::Joy& m,
                               const RosInput& /*input*/,
                               const OrderContext& context,
                               std::string& why) {
  if (m.axes.size() != 1) {
    why = "one axis is wanted";
    return std::nullopt;
  }
  return told(context, TakeOffCommand{static_cast<double>(m.axes[0])});
}

void add_own() {
  if (output_types().find("place") != nullptr) return;
  output_types().add({.name = "place",
                      .help = "where it is by its states",
                      .make = per_sample<place_of>(),
                      .frame = OutputType::Frame::kBody,
                      .has_child = true});
  input_types().add({.name = "height",
                     .help = "how high to take off",
                     .make = ordered_by<to_height>(),
                     .one_shot = true});
}

class Counter : public Outlet {
 public:
  [[nodiscard]] Wire wire() const override { return Wire::kCdr; }
  int advertise(const Topic& topic) override {
    topics.push_back(topic);
    return static_cast<int>(topics.size()) - 1;
  }
  [[nodiscard]] bool has_readers(int /*topic*/) const override { return true; }
  void send(int topic, const Bytes& bytes, std::int64_t /*time*/) override {
    const std::string& name = topics[static_cast<std::size_t>(topic)].name;
    if (name == "/drone0/here") sent.push_back(bytes);
    if (name == "/tf_static") transforms = decode<Wire::kCdr, msg::TFMessage>(*bytes);
  }
  std::vector<Topic> topics;
  std::vector<Bytes> sent;
  std::optional<msg::TFMessage> transforms;
};

TEST(OwnOutputs, AreSentUnderTheNamesOfScenariosAndProfiles) {
  add_own();
  Scenario scenario = parse_scenario(
      "map: m.pfmap\nduration: 1\nvehicle: {start: [10, 6, 3]}\nlidars: []\n"
      "ros: {outputs: [{kind: place, topic: '{vehicle}/here', frame: map, rate: 20,\n"
      "                 child_frame: x}]}\n",
      "s.yaml");
  const Executor executor(1);
  Simulation simulation(scenario, hall(), executor);
  RosBridge bridge(describe_run(simulation), profile_for(scenario), Duration{0});
  Counter counter;
  bridge.add(counter);
  bridge.start();
  while (simulation.step(bridge)) bridge.on_time(simulation.time());
  ASSERT_EQ(counter.sent.size(), 21u);
  const auto first = decode<Wire::kCdr, msg::PoseStamped>(*counter.sent.front());
  ASSERT_TRUE(first);
  EXPECT_EQ(first->header.frame_id, "map");
  EXPECT_EQ(first->pose.position.x, 10.0);
  ASSERT_TRUE(counter.transforms);
  EXPECT_TRUE(counter.transforms->transforms.empty()) << "its frame is no sensor's";
}

TEST(OwnOutputs, KeysWithoutEffectAreRefusedForThemToo) {
  add_own();
  const auto error = [](const std::string& output) {
    return error_of([&] {
      profile_for(parse_scenario("map: m.pfmap\nros: {outputs: [" + output + "]}\n", "s.yaml"));
    });
  };
  expect_contains(error("{kind: place, topic: /a, layout: xyzi}"), "layout: has no effect");
  expect_contains(error("{kind: places, topic: /a}"), "did you mean 'place'?");
}

TEST(OwnInputs, BecomeOrdersForEachVehicle) {
  add_own();
  RosProfile profile;
  profile.inputs.emplace_back();
  profile.inputs[0].kind = "height";
  profile.inputs[0].topic = "/height";
  Scenario scenario = hovering();
  scenario.vehicles.push_back(scenario.vehicles[0]);
  scenario.vehicles[1].name = "other";
  scenario.vehicles[1].start = {14, 6, 3};
  const Executor executor(1);
  const Simulation simulation(scenario, hall(), executor);
  const auto streams = input_streams(describe_run(simulation), profile);
  ASSERT_EQ(streams.size(), 1u);
  EXPECT_TRUE(streams[0].for_all);
  const auto read = [&](std::vector<float> axes, std::string& reason) {
    msg::Joy joy;
    joy.axes = std::move(axes);
    const auto bytes = encode<Wire::kCdr>(joy);
    Received received;
    received.data = bytes.data();
    received.size = bytes.size();
    std::vector<OrderContext> contexts(2);
    contexts[1].vehicle = 1;
    return orders_of(streams[0], Wire::kCdr, received, contexts, reason);
  };
  std::string reason;
  const auto orders = read({2.5f}, reason);
  ASSERT_EQ(orders.size(), 2u);
  const auto& last = std::get<VehicleOrder>(orders[1]);
  EXPECT_EQ(last.vehicle, 1u);
  EXPECT_EQ(std::get<TakeOffCommand>(last.command).height, 2.5);
  EXPECT_TRUE(read({}, reason).empty());
  expect_contains(reason, "/height: one axis is wanted");
}

}  // namespace
}  // namespace pointflight
