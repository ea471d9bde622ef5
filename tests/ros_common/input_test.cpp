// What messages from outside are taken for.
#include <gtest/gtest.h>

#include <cmath>

#include "pointflight/core/constants.hpp"
#include "pointflight/geometry/rotation.hpp"
#include "pointflight/ros/common/description.hpp"
#include "pointflight/ros/common/inputs.hpp"
#include "pointflight/ros/common/ros1_definition.hpp"
#include "tests/ros_common/keeper.hpp"
#include "tests/sim/runs.hpp"

namespace pointflight {
namespace {

using testing::expect_contains;

OrderContext context() {
  OrderContext c;
  c.mass = 2.0;
  c.thrust_max = 40.0;
  c.world_frame = "world";
  c.body_frame = "drone0/base_link";
  return c;
}

/// The order for a message of a kind, by either wire.
template <Wire W, class M>
std::optional<Order> order_for(const std::string& kind,
                               const M& message,
                               const std::string& definition = "",
                               RotorUnit unit = RotorUnit::kSi) {
  const auto bytes = encode<W>(message);
  InputStream stream;
  stream.type = input_types().find(kind);
  stream.settings.unit = unit;
  if constexpr (std::is_same_v<M, msg::PositionCommandLong>) {
    stream.settings.package = CommandPackage::kMarsQuadrotorMsgs;
  }
  stream.topic.name = "/in";
  stream.topic.type = message_type<M>();
  Received received;
  received.data = bytes.data();
  received.size = bytes.size();
  received.md5 = definition.empty() ? stream.topic.type.md5 : "unknown";
  received.definition = definition.empty() ? stream.topic.type.definition : definition;
  std::string reason;
  const OrderContext contexts[] = {context()};
  auto orders = orders_of(stream, W, received, contexts, reason);
  if (orders.empty()) {
    expect_contains(reason, "/in: a message of");
    return std::nullopt;
  }
  EXPECT_EQ(reason, "");
  return orders.front();
}

TEST(Inputs, FramesThatAreNotKnownAreRefused) {
  const auto reason_for =
      [](const std::string& kind, const auto& message, const OrderContext& c) -> std::string {
    std::string reason;
    return testing::orders_for(kind, message, c, reason).empty() ? reason : "taken";
  };
  OrderContext alias = context();
  alias.world_alias = "map";
  msg::PoseStamped goal;
  goal.pose.orientation.w = 1.0;
  msg::TwistStamped velocity;
  msg::PositionCommandShort position;
  const auto check = [&](const std::string& kind, auto message) {
    const bool has_body = kind == "velocity";
    for (const char* frame : {"", "world", "/world"}) {
      message.header.frame_id = frame;
      EXPECT_EQ(reason_for(kind, message, context()), "taken") << kind << " " << frame;
    }
    for (const char* frame : {"map", "odom", "world2", "drone1/base_link"}) {
      message.header.frame_id = frame;
      expect_contains(reason_for(kind, message, context()),
                      "/in: frame '" + std::string(frame) + "' is not known; it is 'world' here");
    }
    for (const char* frame : {"drone0/base_link", "base_link"}) {
      message.header.frame_id = frame;
      EXPECT_EQ(reason_for(kind, message, context()) == "taken", has_body) << kind << " " << frame;
    }
    message.header.frame_id = "map";
    EXPECT_EQ(reason_for(kind, message, alias), "taken") << kind;
  };
  check("goal", goal);
  check("velocity", velocity);
  check("position", position);
}

template <class C>
C command_in(const std::optional<Order>& order) {
  EXPECT_TRUE(order);
  return std::get<C>(std::get<VehicleOrder>(order.value()).command);
}

template <class M>
M position_message() {
  M m;
  m.position = {1, 2, 3};
  m.velocity = {4, 5, 6};
  m.acceleration = {7, 8, 9};
  m.yaw = 0.5;
  m.yaw_dot = 0.25;
  return m;
}

void expect_position(const PositionCommand& c) {
  EXPECT_EQ(c.p_world, Vector3d(1, 2, 3));
  EXPECT_EQ(c.v_world, Vector3d(4, 5, 6));
  EXPECT_EQ(c.a_world, Vector3d(7, 8, 9));
  EXPECT_EQ(c.yaw, 0.5);
  EXPECT_EQ(c.yaw_rate, 0.25);
}

TEST(Inputs, AllPositionCommandsAreUnderstood) {
  expect_position(command_in<PositionCommand>(
      order_for<Wire::kRos1>("position", position_message<msg::PositionCommandShort>())));
  expect_position(command_in<PositionCommand>(
      order_for<Wire::kRos1>("position", position_message<msg::PositionCommandOldest>())));
  auto longer = position_message<msg::PositionCommandLong>();
  longer.jerk = {1, 1, 2};
  const auto c = command_in<PositionCommand>(order_for<Wire::kRos1>("position", longer));
  expect_position(c);
  EXPECT_EQ(c.jerk_world, Vector3d(1, 1, 2));
  EXPECT_EQ(command_in<PositionCommand>(order_for<Wire::kCdr>("position", longer)).jerk_world.z(),
            2.0);
  expect_position(command_in<PositionCommand>(
      order_for<Wire::kCdr>("position", position_message<msg::PositionCommandShort>())));
}

TEST(Inputs, APositionCommandThatNobodyKnowsIsReadByItsDefinition) {
  // the short one with a comment, a constant, a name without package and an array: another md5
  const std::string own =
      "# mine\nHeader header\nuint8 MODE=3\ngeometry_msgs/Point position # m\n"
      "geometry_msgs/Vector3 velocity\ngeometry_msgs/Vector3 acceleration\nfloat64 yaw\n"
      "float64 yaw_dot\nfloat64[3] kx\nfloat64[3] kv\nuint32 trajectory_id\nuint8 "
      "trajectory_flag\n"
      "====\nMSG: std_msgs/Header\nuint32 seq\ntime stamp\nstring frame_id\n"
      "====\nMSG: geometry_msgs/Point\nfloat64 x\nfloat64 y\nfloat64 z\n"
      "====\nMSG: geometry_msgs/Vector3\nfloat64 x\nfloat64 y\nfloat64 z\n";
  expect_position(command_in<PositionCommand>(
      order_for<Wire::kRos1>("position", position_message<msg::PositionCommandShort>(), own)));
  // other bytes than it says, or without an acceleration: refused
  EXPECT_FALSE((order_for<Wire::kRos1>("position",
                                       position_message<msg::PositionCommandShort>(),
                                       own + "MSG: x/Y\n#")) == std::nullopt);
  EXPECT_FALSE(
      (order_for<Wire::kRos1>("position", position_message<msg::PositionCommandLong>(), own)));
  EXPECT_FALSE((order_for<Wire::kRos1>("position", msg::PoseStamped{}, "float64 yaw\n")));
  // a definition that nests itself ends
  EXPECT_FALSE(numbers_of("a/B b\n====\nMSG: a/B\nB b\n", {}));
  const std::vector<std::byte> bytes(4, std::byte{0xff});
  EXPECT_FALSE(numbers_of("string[] names\n", bytes));
}

TEST(Inputs, VelocitiesTurnAndKnowTheirFrame) {
  msg::TwistStamped twist;
  twist.twist.linear = {1, 0, 0.5};
  twist.twist.angular.z = 0.2;
  auto c = command_in<VelocityCommand>(order_for<Wire::kCdr>("velocity", twist));
  EXPECT_FALSE(c.in_body);
  EXPECT_TRUE(c.turn);
  EXPECT_EQ(c.yaw_rate, 0.2);
  twist.header.frame_id = "drone0/base_link";
  c = command_in<VelocityCommand>(order_for<Wire::kRos1>("velocity", twist));
  EXPECT_TRUE(c.in_body);
}

TEST(Inputs, AttitudeTargetsFollowTheirMask) {
  msg::AttitudeTarget target;
  target.thrust = 0.5f;
  target.body_rate = {1, 2, 3};
  target.type_mask = msg::AttitudeTarget::IGNORE_ATTITUDE;
  const auto rates = command_in<BodyRateCommand>(order_for<Wire::kRos1>("attitude", target));
  EXPECT_EQ(rates.omega_body, Vector3d(1, 2, 3));
  EXPECT_EQ(rates.thrust, 20.0);
  target.type_mask = msg::AttitudeTarget::IGNORE_ROLL_RATE |
                     msg::AttitudeTarget::IGNORE_PITCH_RATE | msg::AttitudeTarget::IGNORE_YAW_RATE |
                     msg::AttitudeTarget::IGNORE_THRUST;
  const auto attitude = command_in<AttitudeCommand>(order_for<Wire::kCdr>("attitude", target));
  EXPECT_EQ(attitude.omega_body, Vector3d(0, 0, 0));
  EXPECT_EQ(attitude.thrust, 2.0 * kGravity);
}

TEST(Inputs, RotorsGoalsSticksAndTheRest) {
  msg::Float32MultiArray rotors;
  rotors.data = {60.0f, 120.0f};
  EXPECT_NEAR(
      command_in<RotorSpeedCommand>(order_for<Wire::kRos1>("rotors", rotors, "", RotorUnit::kRpm))
          .speeds[1],
      4.0 * kPi,
      1e-9);
  msg::PoseStamped goal;
  goal.pose.position = {3, 4, 0};
  goal.pose.orientation = {0, 0, std::sqrt(0.5), std::sqrt(0.5)};
  const auto waypoint = command_in<WaypointCommand>(order_for<Wire::kRos1>("goal", goal));
  EXPECT_TRUE(waypoint.keep_height);
  EXPECT_NEAR(*waypoint.mission.final_yaw, kPi / 2, 1e-9);
  msg::Joy joy;
  joy.axes = {0.5f, 0, 0, 0, 1.0f};
  EXPECT_TRUE(command_in<VelocityCommand>(order_for<Wire::kCdr>("joy", joy)).in_body);
  joy.buttons = {1};
  EXPECT_EQ(command_in<TakeOffCommand>(order_for<Wire::kCdr>("joy", joy)).height, 1.5);
  EXPECT_TRUE(std::get<PauseOrder>(*order_for<Wire::kCdr>("pause", msg::Bool{true})).pause);
  EXPECT_TRUE(std::holds_alternative<ResetOrder>(*order_for<Wire::kRos1>("reset", msg::Empty{})));
  EXPECT_TRUE(std::holds_alternative<StepOrder>(*order_for<Wire::kCdr>("step", msg::Empty{})));
  command_in<LandCommand>(order_for<Wire::kCdr>("take_off_land", msg::TakeoffLand{2}));
  goal.pose.position.x = std::nan("");
  EXPECT_FALSE((order_for<Wire::kRos1>("goal", goal)));
}

TEST(Commands, ABodyVelocityFollowsTheHeadingThatTurns) {
  Scenario scenario = testing::hovering();
  scenario.duration = 8.0;
  const Executor executor(1);
  Simulation simulation(scenario, testing::hall(), executor);
  SampleSplitter sink;
  VelocityCommand ahead;
  ahead.v_world = {1, 0, 0};
  ahead.yaw_rate = kPi / 4;
  ahead.turn = true;
  ahead.in_body = true;
  for (int i = 1; i <= 40; ++i) {
    simulation.command(0, ahead);
    simulation.advance_to(SimTime(std::chrono::milliseconds(100 * i)), sink);
  }
  // half a turn of a circle of radius 4 / pi
  const RigidBodyState& body = simulation.status(0).state.body;
  EXPECT_NEAR(std::abs(yaw_of(body.q_world_body)), kPi, 0.1);
  EXPECT_NEAR(body.p_world.y(), 6.0 + 8.0 / kPi, 0.5);
  EXPECT_LT(body.v_world.x(), -0.8);
}

TEST(Commands, AGoalKeepsTheHeightAndEndsAtItsHeading) {
  Scenario scenario = testing::hovering();
  scenario.duration = 20.0;
  const Executor executor(1);
  Simulation simulation(scenario, testing::hall(), executor);
  SampleSplitter sink;
  WaypointCommand goal;
  goal.mission.waypoints = {{13, 7, 0}};
  goal.mission.final_yaw = -kPi / 2;
  goal.keep_height = true;
  EXPECT_FALSE(simulation.command(0, goal));
  simulation.advance_to(SimTime(std::chrono::seconds(12)), sink);
  const RigidBodyState& body = simulation.status(0).state.body;
  EXPECT_LT((body.p_world - Vector3d(13, 7, 3)).norm(), 0.05);
  EXPECT_NEAR(yaw_of(body.q_world_body), -kPi / 2, 0.02);
}

}  // namespace
}  // namespace pointflight
