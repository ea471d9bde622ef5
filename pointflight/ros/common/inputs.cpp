#include "pointflight/ros/common/inputs.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "pointflight/core/constants.hpp"
#include "pointflight/geometry/rotation.hpp"
#include "pointflight/ros/common/conversion.hpp"
#include "pointflight/ros/common/description.hpp"
#include "pointflight/ros/common/output.hpp"
#include "pointflight/ros/common/ros1_definition.hpp"

namespace pointflight {
namespace {

constexpr double kRadPerSecond = kPi / 30.0;  // of an rpm

/// Of a message's frame; none is the world's.
bool is_world(const std::string& frame, const OrderContext& context) {
  const std::string name = bare_frame(frame);
  return name.empty() || name == context.world_frame ||
         (!context.world_alias.empty() && name == context.world_alias);
}

bool is_map(const std::string& frame, const OrderContext& context) {
  return context.map_frame.is_used() && bare_frame(frame) == context.map_frame.name;
}

/// Where the zero of a message's frame is in the world, m; nothing for a frame that is not known.
std::optional<Vector3d> origin_of(const std::string& frame, const OrderContext& context) {
  if (is_map(frame, context)) return context.map_frame.origin;
  return is_world(frame, context) ? std::optional<Vector3d>(Vector3d::Zero()) : std::nullopt;
}

bool is_body(const std::string& frame, const OrderContext& context) {
  const std::string name = bare_frame(frame);
  return name == context.body_frame || name == "base_link";
}

std::string unknown_frame(const std::string& frame, const OrderContext& context) {
  return fmt::format(
      "frame '{}' is not known; it is '{}' here (ros.world_alias gives that "
      "another name)",
      frame,
      context.world_frame);
}

template <class M>
PositionCommand position_from(const M& m) {
  PositionCommand command;
  command.p_world = vector_of(m.position);
  command.v_world = vector_of(m.velocity);
  command.a_world = vector_of(m.acceleration);
  if constexpr (requires { m.jerk; }) command.jerk_world = vector_of(m.jerk);
  command.yaw = m.yaw;
  command.yaw_rate = m.yaw_dot;
  return command;
}

/// A PositionCommand, and the frame that it is in.
struct FramedPosition {
  PositionCommand command;
  std::string frame;
};

template <class M>
std::optional<FramedPosition> position_as(Wire wire, const Received& received) {
  const auto m = message_in<M>(wire, received);
  return m ? std::optional(FramedPosition{position_from(*m), m->header.frame_id}) : std::nullopt;
}

/// By the names of its fields, in a definition that nobody here knows.
std::optional<FramedPosition> position_by_names(const Received& received) {
  const auto numbers = numbers_of(received.definition, std::span(received.data, received.size));
  if (!numbers) return std::nullopt;
  FramedPosition position;
  PositionCommand& command = position.command;
  const auto take = [&](const std::string& name, double& value) {
    const auto found = numbers->find(name);
    if (found != numbers->end()) value = found->second;
    return found != numbers->end();
  };
  bool all = true;
  const auto vector = [&](const char* name, Vector3d& v, bool needed) {
    const char* axes[3] = {".x", ".y", ".z"};
    for (int i = 0; i < 3; ++i) all = (take(std::string(name) + axes[i], v[i]) || !needed) && all;
  };
  vector("position", command.p_world, true);
  vector("velocity", command.v_world, true);
  vector("acceleration", command.a_world, true);
  vector("jerk", command.jerk_world, false);
  all = take("yaw", command.yaw) && all;
  take("yaw_dot", command.yaw_rate);
  return all ? std::optional(position) : std::nullopt;
}

/// A PositionCommand of any definition: by md5, else by the names of its fields.
std::optional<FramedPosition> position_in(const RosInput& input,
                                          Wire wire,
                                          const Received& received) {
  if (wire == Wire::kCdr) {
    return input.package == CommandPackage::kQuadrotorMsgs
               ? position_as<msg::PositionCommandShort>(wire, received)
               : position_as<msg::PositionCommandLong>(wire, received);
  }
  if (auto p = position_as<msg::PositionCommandLong>(wire, received)) return p;
  if (auto p = position_as<msg::PositionCommandShort>(wire, received)) return p;
  if (auto p = position_as<msg::PositionCommandOldest>(wire, received)) return p;
  return position_by_names(received);
}

OrderMaker read_position(const RosInput& input, Wire wire, const Received& received) {
  const auto position = position_in(input, wire, received);
  if (!position) return {};
  return [position](const OrderContext& context, std::string& why) -> std::optional<Order> {
    const auto origin = origin_of(position->frame, context);
    if (!origin) {
      why = unknown_frame(position->frame, context);
      return std::nullopt;
    }
    PositionCommand command = position->command;
    command.p_world += *origin;
    return told(context, command);
  };
}

MessageType position_type(const RosInput& input) {
  // ROS 1 names both "quadrotor_msgs" and reads each in its sender's own words
  return input.package == CommandPackage::kQuadrotorMsgs ? message_type<msg::PositionCommandShort>()
                                                         : message_type<msg::PositionCommandLong>();
}

std::optional<Order> velocity_order(const msg::TwistStamped& m,
                                    const RosInput& input,
                                    const OrderContext& context,
                                    std::string& why) {
  VelocityCommand command;
  command.v_world = vector_of(m.twist.linear);
  command.yaw_rate = m.twist.angular.z;
  const std::string& frame = m.header.frame_id;
  const bool is_turned_as_world = is_world(frame, context) || is_map(frame, context);
  if (!is_turned_as_world && !is_body(frame, context)) {
    why = unknown_frame(frame, context);
    return std::nullopt;
  }
  const bool in_world = frame.empty() ? input.frame == VelocityFrame::kWorld : is_turned_as_world;
  command.in_body = !in_world;
  command.turn = true;
  return told(context, command);
}

std::optional<Order> attitude_order(const msg::AttitudeTarget& m,
                                    const RosInput& /*input*/,
                                    const OrderContext& context,
                                    std::string& /*why*/) {
  const bool no_thrust = (m.type_mask & msg::AttitudeTarget::IGNORE_THRUST) != 0;
  const double thrust =
      no_thrust ? context.mass * kGravity : static_cast<double>(m.thrust) * context.thrust_max;
  Vector3d omega = vector_of(m.body_rate);
  if ((m.type_mask & msg::AttitudeTarget::IGNORE_ROLL_RATE) != 0) omega.x() = 0.0;
  if ((m.type_mask & msg::AttitudeTarget::IGNORE_PITCH_RATE) != 0) omega.y() = 0.0;
  if ((m.type_mask & msg::AttitudeTarget::IGNORE_YAW_RATE) != 0) omega.z() = 0.0;
  if ((m.type_mask & msg::AttitudeTarget::IGNORE_ATTITUDE) != 0) {
    return told(context, BodyRateCommand{omega, thrust});
  }
  // a quaternion with a NaN stays one: the autopilot refuses it
  const msg::Quaternion& q = m.orientation;
  return told(context, AttitudeCommand{Quaterniond(q.w, q.x, q.y, q.z), thrust, omega});
}

/// Sticks as most pads have them: left up and down climbs, left aside turns, right moves. Buttons:
/// 0 takes off, 1 lands, 2 hovers.
std::optional<Order> stick_order(const msg::Joy& m,
                                 const RosInput& /*input*/,
                                 const OrderContext& context,
                                 std::string& /*why*/) {
  const auto pressed = [&](std::size_t i) { return i < m.buttons.size() && m.buttons[i] != 0; };
  if (pressed(0)) return told(context, TakeOffCommand{});
  if (pressed(1)) return told(context, LandCommand{});
  if (pressed(2)) return told(context, HoverCommand{});
  const auto axis = [&](std::size_t i) {
    return i < m.axes.size() ? static_cast<double>(m.axes[i]) : 0.0;
  };
  VelocityCommand command;
  command.v_world = context.motion.speed * Vector3d(axis(4), axis(3), axis(1));
  command.yaw_rate = axis(0);
  command.in_body = true;
  command.turn = true;
  return told(context, command);
}

std::optional<Order> goal_order(const msg::PoseStamped& m,
                                const RosInput& /*input*/,
                                const OrderContext& context,
                                std::string& why) {
  const auto origin = origin_of(m.header.frame_id, context);
  if (!origin) {
    why = unknown_frame(m.header.frame_id, context);
    return std::nullopt;
  }
  Vector3d p = vector_of(m.pose.position);
  if (!p.allFinite()) return std::nullopt;
  WaypointCommand command;
  command.mission.motion = context.motion;
  // RViz' flat tool knows no height
  command.keep_height = p.z() == 0.0;
  p += *origin;
  command.mission.waypoints = {p};
  command.mission.final_yaw = yaw_of(rotation_of(m.pose.orientation));
  return told(context, command);
}

std::optional<Order> rotors_order(const msg::Float32MultiArray& m,
                                  const RosInput& input,
                                  const OrderContext& context,
                                  std::string& /*why*/) {
  const double unit = input.unit == RotorUnit::kRpm ? kRadPerSecond : 1.0;
  RotorSpeedCommand rotors;
  for (const float w : m.data) rotors.speeds.push_back(unit * static_cast<double>(w));
  return told(context, rotors);
}

std::optional<Order> take_off_land_order(const msg::TakeoffLand& m,
                                         const RosInput& /*input*/,
                                         const OrderContext& context,
                                         std::string& /*why*/) {
  const bool up = m.takeoff_land_cmd == msg::TakeoffLand::TAKEOFF;
  return up ? told(context, TakeOffCommand{}) : told(context, LandCommand{});
}

std::optional<Order> pause_order(const msg::Bool& m,
                                 const RosInput& /*input*/,
                                 const OrderContext& /*context*/,
                                 std::string& /*why*/) {
  return PauseOrder{m.data};
}

/// Of a message that says nothing but that it came: a command for a vehicle, or an order.
template <class O>
std::optional<Order> plain_order(const msg::Empty& /*m*/,
                                 const RosInput& /*input*/,
                                 const OrderContext& context,
                                 std::string& /*why*/) {
  if constexpr (std::is_constructible_v<Command, O>) {
    return told(context, O{});
  } else {
    return O{};
  }
}

}  // namespace

Registry<InputType>& input_types() {
  static Registry<InputType> types = {
      {.name = "position",
       .help = "position, velocity, acceleration, yaw at each instant",
       .make = {position_type, read_position},
       .answers = true},
      {.name = "goal", .help = "where to fly", .make = ordered_by<goal_order>(), .one_shot = true},
      {.name = "velocity",
       .help = "velocity and yaw rate",
       .make = ordered_by<velocity_order>(),
       .answers = true},
      {.name = "attitude",
       .help = "attitude or body rates, and thrust",
       .make = ordered_by<attitude_order>(),
       .answers = true},
      {.name = "rotors",
       .help = "speeds of the rotors",
       .make = ordered_by<rotors_order>(),
       .answers = true},
      {.name = "joy", .help = "a gamepad", .make = ordered_by<stick_order>()},
      {.name = "take_off_land",
       .help = "take off or land",
       .make = ordered_by<take_off_land_order>(),
       .one_shot = true},
      {.name = "hover",
       .help = "hold the place",
       .make = ordered_by<plain_order<HoverCommand>>(),
       .one_shot = true},
      {.name = "pause",
       .help = "the run stands still, or goes on",
       .make = ordered_by<pause_order>(),
       .service = &kPauseService},
      {.name = "step",
       .help = "while paused: until the next scan",
       .make = ordered_by<plain_order<StepOrder>>(),
       .service = &kStepService},
      {.name = "reset",
       .help = "back to the start",
       .make = ordered_by<plain_order<ResetOrder>>(),
       .service = &kResetService},
      {.name = "arm",
       .help = "rotors may turn",
       .make = ordered_by<plain_order<ArmCommand>>(),
       .one_shot = true},
  };
  return types;
}

std::vector<Order> orders_of(const InputStream& stream,
                             Wire wire,
                             const Received& received,
                             std::span<const OrderContext> contexts,
                             std::string& reason) {
  std::vector<Order> orders;
  const OrderMaker order_for = stream.type->make.read(stream.settings, wire, received);
  for (const OrderContext& context : contexts) {
    std::string why;
    auto order = order_for ? order_for(context, why) : std::nullopt;
    if (!order) {
      reason = !why.empty()
                   ? fmt::format("{}: {}", stream.topic.name, why)
                   : fmt::format(
                         "{}: a message of {} bytes that is no {}{}",
                         stream.topic.name,
                         received.size,
                         stream.topic.type.ros1_name(),
                         wire == Wire::kRos1 ? fmt::format(" (its md5 is {})", received.md5) : "");
      return orders;
    }
    if (auto* vehicle = std::get_if<VehicleOrder>(&*order)) {
      vehicle->is_answer = stream.type->answers;
    }
    orders.push_back(std::move(*order));
  }
  return orders;
}

std::vector<InputStream> input_streams(const RunDescription& run, const RosProfile& profile) {
  std::vector<InputStream> streams;
  for (const RosInput& input : profile.inputs) {
    const InputType* type = input_types().find(input.kind);
    if (type == nullptr || !is_used(input.topic)) continue;
    const bool once = type->is_of_run() || !names_vehicle(input.topic);
    const std::size_t vehicles = once ? 1 : run.vehicles.size();
    for (std::size_t v = 0; v < vehicles; ++v) {
      if (!once && !run.vehicles[v].own) continue;
      const RosNames names = names_of(profile, run.vehicles[v].setup, v);
      InputStream& stream = streams.emplace_back();
      stream.type = type;
      stream.settings = input;
      stream.settings.topic = absolute(with_names(input.topic, names));
      stream.topic.name = stream.settings.topic;
      stream.topic.type = type->make.type(input);
      stream.topic.reliable = type->one_shot || type->is_of_run();
      stream.topic.answers = type->answers;
      stream.vehicle = v;
      stream.for_all = once && !type->is_of_run();
    }
  }
  return streams;
}

}  // namespace pointflight
