#include "ros_common/inputs.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "pointflight/core/constants.hpp"
#include "pointflight/geometry/rotation.hpp"
#include "ros_common/conversion.hpp"
#include "ros_common/description.hpp"
#include "ros_common/outputs.hpp"
#include "ros_common/ros1_definition.hpp"
#include "ros_common/services.hpp"

namespace pointflight {
namespace {

constexpr double kRadPerSecond = kPi / 30.0;  // of an rpm
constexpr std::size_t kOrdersMax = 10000;     // that wait; older ones go

/// The message in a received one's bytes, where it has our definition.
template <class M>
std::optional<M> decoded(Wire wire, const Received& received) {
  const std::span bytes(received.data, received.size);
  if (wire == Wire::kCdr) return decode<Wire::kCdr, M>(bytes);
  static const std::string md5 = md5_of(describe_message<M>(1));
  if (received.md5 != md5) return std::nullopt;
  return decode<Wire::kRos1, M>(bytes);
}

/// As it is compared: tf of old wrote a leading /.
std::string bare(const std::string& frame) {
  return frame.starts_with('/') ? frame.substr(1) : frame;
}

/// Of a message's frame; none is the world's.
bool is_world(const std::string& frame, const OrderContext& context) {
  const std::string name = bare(frame);
  return name.empty() || name == context.world_frame ||
         (!context.world_alias.empty() && name == context.world_alias);
}

bool is_body(const std::string& frame, const OrderContext& context) {
  const std::string name = bare(frame);
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

/// A PositionCommand of any definition: by md5, else by the names of its fields.
std::optional<PositionCommand> position_of(const InputStream& stream,
                                           Wire wire,
                                           const Received& received,
                                           const OrderContext& context,
                                           std::string& why) {
  const auto taken = [&](const auto& m) -> std::optional<PositionCommand> {
    if (!is_world(m.header.frame_id, context)) {
      why = unknown_frame(m.header.frame_id, context);
      return std::nullopt;
    }
    return position_from(m);
  };
  if (wire == Wire::kCdr) {
    if (stream.topic.type.ros2_package == msg::PositionCommandLong::kType.ros2_package) {
      const auto m = decoded<msg::PositionCommandLong>(wire, received);
      return m ? taken(*m) : std::nullopt;
    }
    const auto m = decoded<msg::PositionCommandShort>(wire, received);
    return m ? taken(*m) : std::nullopt;
  }
  if (const auto m = decoded<msg::PositionCommandLong>(wire, received)) return taken(*m);
  if (const auto m = decoded<msg::PositionCommandShort>(wire, received)) return taken(*m);
  if (const auto m = decoded<msg::PositionCommandOldest>(wire, received)) return taken(*m);
  const auto numbers = numbers_of(received.definition, std::span(received.data, received.size));
  if (!numbers) return std::nullopt;
  PositionCommand command;
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
  return all ? std::optional(command) : std::nullopt;
}

std::optional<Command> velocity_from(const msg::TwistStamped& m,
                                     const InputStream& stream,
                                     const OrderContext& context,
                                     std::string& why) {
  VelocityCommand command;
  command.v_world = vector_of(m.twist.linear);
  command.yaw_rate = m.twist.angular.z;
  const std::string& frame = m.header.frame_id;
  if (!is_world(frame, context) && !is_body(frame, context)) {
    why = unknown_frame(frame, context);
    return std::nullopt;
  }
  const bool in_world = frame.empty() ? stream.settings.frame == "world" : is_world(frame, context);
  command.in_body = !in_world;
  command.turn = true;
  return command;
}

Command attitude_from_target(const msg::AttitudeTarget& m, const OrderContext& context) {
  const bool no_thrust = (m.type_mask & msg::AttitudeTarget::kIgnoreThrust) != 0;
  const double thrust =
      no_thrust ? context.mass * kGravity : static_cast<double>(m.thrust) * context.thrust_max;
  Vector3d omega = vector_of(m.body_rate);
  if ((m.type_mask & msg::AttitudeTarget::kIgnoreRollRate) != 0) omega.x() = 0.0;
  if ((m.type_mask & msg::AttitudeTarget::kIgnorePitchRate) != 0) omega.y() = 0.0;
  if ((m.type_mask & msg::AttitudeTarget::kIgnoreYawRate) != 0) omega.z() = 0.0;
  if ((m.type_mask & msg::AttitudeTarget::kIgnoreAttitude) != 0) {
    return BodyRateCommand{omega, thrust};
  }
  // a quaternion with a NaN stays one: the autopilot refuses it
  const msg::Quaternion& q = m.orientation;
  return AttitudeCommand{Quaterniond(q.w, q.x, q.y, q.z), thrust, omega};
}

/// Sticks as most pads have them: left up and down climbs, left aside turns, right moves. Buttons:
/// 0 takes off, 1 lands, 2 hovers.
Command stick_command(const msg::Joy& m, const OrderContext& context) {
  const auto pressed = [&](std::size_t i) { return i < m.buttons.size() && m.buttons[i] != 0; };
  if (pressed(0)) return TakeOffCommand{};
  if (pressed(1)) return LandCommand{};
  if (pressed(2)) return HoverCommand{};
  const auto axis = [&](std::size_t i) {
    return i < m.axes.size() ? static_cast<double>(m.axes[i]) : 0.0;
  };
  VelocityCommand command;
  command.v_world = context.motion.speed * Vector3d(axis(4), axis(3), axis(1));
  command.yaw_rate = axis(0);
  command.in_body = true;
  command.turn = true;
  return command;
}

std::optional<Command> goal_from(const msg::PoseStamped& m,
                                 const OrderContext& context,
                                 std::string& why) {
  if (!is_world(m.header.frame_id, context)) {
    why = unknown_frame(m.header.frame_id, context);
    return std::nullopt;
  }
  const Vector3d p = vector_of(m.pose.position);
  if (!p.allFinite()) return std::nullopt;
  WaypointCommand command;
  command.mission.motion = context.motion;
  command.mission.waypoints = {p};
  // RViz' flat tool knows no height
  command.keep_height = p.z() == 0.0;
  command.mission.final_yaw = yaw_of(rotation_of(m.pose.orientation));
  return command;
}

Command rotors_from(const msg::Float32MultiArray& m, const InputStream& stream) {
  const double unit = stream.settings.unit == "rpm" ? kRadPerSecond : 1.0;
  RotorSpeedCommand rotors;
  for (const float w : m.data) rotors.speeds.push_back(unit * static_cast<double>(w));
  return rotors;
}

/// How a kind of message becomes a command.
struct Reader {
  const char* kind;
  bool is_answer;
  /// `why`: in words, where it is refused for something else than its bytes.
  std::optional<Command> (*read)(
      const InputStream&, Wire, const Received&, const OrderContext&, std::string& why);
};

constexpr Reader kReaders[] = {
    {"position",
     true,
     [](const InputStream& stream,
        Wire wire,
        const Received& in,
        const OrderContext& context,
        std::string& why) {
       const auto m = position_of(stream, wire, in, context, why);
       return m ? std::optional<Command>(*m) : std::nullopt;
     }},
    {"goal",
     false,
     [](const InputStream&,
        Wire wire,
        const Received& in,
        const OrderContext& context,
        std::string& why) {
       const auto m = decoded<msg::PoseStamped>(wire, in);
       return m ? goal_from(*m, context, why) : std::nullopt;
     }},
    {"velocity",
     true,
     [](const InputStream& stream,
        Wire wire,
        const Received& in,
        const OrderContext& context,
        std::string& why) {
       const auto m = decoded<msg::TwistStamped>(wire, in);
       return m ? velocity_from(*m, stream, context, why) : std::nullopt;
     }},
    {"attitude",
     true,
     [](const InputStream&,
        Wire wire,
        const Received& in,
        const OrderContext& context,
        std::string&) {
       const auto m = decoded<msg::AttitudeTarget>(wire, in);
       return m ? std::optional(attitude_from_target(*m, context)) : std::nullopt;
     }},
    {"rotors",
     true,
     [](const InputStream& stream,
        Wire wire,
        const Received& in,
        const OrderContext&,
        std::string&) {
       const auto m = decoded<msg::Float32MultiArray>(wire, in);
       return m ? std::optional(rotors_from(*m, stream)) : std::nullopt;
     }},
    {"joy",
     false,
     [](const InputStream&,
        Wire wire,
        const Received& in,
        const OrderContext& context,
        std::string&) {
       const auto m = decoded<msg::Joy>(wire, in);
       return m ? std::optional(stick_command(*m, context)) : std::nullopt;
     }},
    {"take_off_land",
     false,
     [](const InputStream&, Wire wire, const Received& in, const OrderContext&, std::string&) {
       const auto m = decoded<msg::TakeoffLand>(wire, in);
       if (!m) return std::optional<Command>();
       const bool up = m->takeoff_land_cmd == msg::TakeoffLand::kTakeoff;
       return std::optional(up ? Command{TakeOffCommand{}} : Command{LandCommand{}});
     }},
    {"hover",
     false,
     [](const InputStream&, Wire wire, const Received& in, const OrderContext&, std::string&) {
       const auto m = decoded<msg::Empty>(wire, in);
       return m ? std::optional<Command>(HoverCommand{}) : std::nullopt;
     }},
    {"arm",
     false,
     [](const InputStream&, Wire wire, const Received& in, const OrderContext&, std::string&) {
       const auto m = decoded<msg::Empty>(wire, in);
       return m ? std::optional<Command>(ArmCommand{}) : std::nullopt;
     }},
};

/// What is about the run and not about a vehicle.
std::optional<Order> run_order_of(const std::string& kind, Wire wire, const Received& received) {
  if (kind == "pause") {
    const auto m = decoded<msg::Bool>(wire, received);
    return m ? std::optional<Order>(PauseOrder{m->data}) : std::nullopt;
  }
  if (!decoded<msg::Empty>(wire, received)) return std::nullopt;
  if (kind == "step") return StepOrder{};
  if (kind == "reset") return ResetOrder{};
  return std::nullopt;
}

}  // namespace

std::optional<Order> order_of(const InputStream& stream,
                              Wire wire,
                              const Received& received,
                              const OrderContext& context,
                              std::string& reason) {
  const std::string& kind = stream.settings.kind;
  const auto reader = std::find_if(
      std::begin(kReaders), std::end(kReaders), [&](const Reader& r) { return kind == r.kind; });
  std::optional<Order> order;
  std::string why;
  if (reader == std::end(kReaders)) {
    order = run_order_of(kind, wire, received);
  } else if (const auto command = reader->read(stream, wire, received, context, why)) {
    order = VehicleOrder{stream.vehicle, *command, reader->is_answer};
  }
  if (!order && !why.empty()) {
    reason = fmt::format("{}: {}", stream.topic.name, why);
  } else if (!order) {
    reason = fmt::format("{}: a message of {} bytes that is no {}{}",
                         stream.topic.name,
                         received.size,
                         stream.topic.type.ros1_name(),
                         wire == Wire::kRos1 ? fmt::format(" (its md5 is {})", received.md5) : "");
  }
  return order;
}

namespace {

/// The type that an input is read with. One topic has one type: ROS 2's tools take no other.
MessageType type_for(const RosInput& input) {
  const std::string& kind = input.kind;
  if (kind == "position") {
    // ROS 1 names both "quadrotor_msgs" and reads each in its sender's own words
    return input.package == "quadrotor_msgs" ? message_type<msg::PositionCommandShort>()
                                             : message_type<msg::PositionCommandLong>();
  }
  if (kind == "goal") return message_type<msg::PoseStamped>();
  if (kind == "velocity") return message_type<msg::TwistStamped>();
  if (kind == "attitude") return message_type<msg::AttitudeTarget>();
  if (kind == "rotors") return message_type<msg::Float32MultiArray>();
  if (kind == "joy") return message_type<msg::Joy>();
  if (kind == "take_off_land") return message_type<msg::TakeoffLand>();
  if (kind == "pause") return message_type<msg::Bool>();
  return message_type<msg::Empty>();
}

bool is_of_run(const std::string& kind) {
  return kind == "pause" || kind == "step" || kind == "reset";
}

/// What is sent once and counts; the others come in streams, whose next message makes up for a lost
/// one.
bool is_one_shot(const std::string& kind) {
  return is_of_run(kind) || kind == "goal" || kind == "take_off_land" || kind == "hover" ||
         kind == "arm";
}

}  // namespace

namespace {

/// True where lockstep takes such a message for a planner's answer to a scan.
bool is_answer(const std::string& kind) {
  return std::any_of(std::begin(kReaders), std::end(kReaders), [&](const Reader& r) {
    return kind == r.kind && r.is_answer;
  });
}

}  // namespace

std::vector<InputStream> input_streams(const Simulation& simulation, const RosProfile& profile) {
  std::vector<InputStream> streams;
  for (const RosInput& input : profile.inputs) {
    if (input.topic.empty() || input.topic == "-") continue;
    const bool once = is_of_run(input.kind) || !names_vehicle(input.topic);
    const std::size_t vehicles = once ? 1 : simulation.vehicle_count();
    for (std::size_t v = 0; v < vehicles; ++v) {
      const RosNames names{
          simulation.vehicle(v).setup().name, profile.first_id + static_cast<std::int64_t>(v), ""};
      InputStream stream;
      stream.settings = input;
      stream.settings.topic = with_names(input.topic, names);
      if (stream.settings.topic.front() != '/') stream.settings.topic.insert(0, "/");
      stream.topic.name = stream.settings.topic;
      stream.topic.type = type_for(input);
      stream.topic.depth = 10;
      stream.topic.reliable = is_one_shot(input.kind);
      stream.topic.answers = is_answer(input.kind);
      stream.vehicle = v;
      stream.for_all = once && !is_of_run(input.kind);
      streams.push_back(std::move(stream));
    }
  }
  return streams;
}

Inbox::Inbox(const Simulation& simulation, const RosProfile& profile)
    : simulation_(simulation), profile_(profile) {
  for (std::size_t v = 0; v < simulation.vehicle_count(); ++v) {
    const VehicleSettings& s = simulation.vehicle(v).settings();
    OrderContext context;
    context.mass = s.mass;
    context.thrust_max = s.thrust_to_weight() * s.mass * kGravity;
    context.motion = simulation.vehicle(v).setup().mission.motion;
    context.world_frame = bare(profile.world_frame);
    context.world_alias = bare(profile.world_alias);
    context.body_frame = bare(body_frame_of(
        profile,
        {simulation.vehicle(v).setup().name, profile.first_id + static_cast<std::int64_t>(v), ""},
        v));
    contexts_.push_back(context);
  }
}

void Inbox::connect(Transport& transport) {
  const Wire wire = transport.wire();
  for (const InputStream& stream : input_streams(simulation_, profile_)) {
    transport.subscribe(stream.topic, [this, stream, wire](const Received& received) {
      receive(stream, wire, received);
    });
  }
  for (const Service& service : run_services(profile_)) serve(service, transport);
}

void Inbox::serve(const Service& service, Transport& transport) {
  const Wire wire = transport.wire();
  transport.serve(service, [this, service, wire](const Received& request) {
    const auto order = order_in(service, wire, request);
    if (order) push(*order);
    return answer_to(order.has_value(), wire);
  });
}

void Inbox::push(Order order) {
  const std::lock_guard lock(mutex_);
  if (orders_.size() >= kOrdersMax) orders_.erase(orders_.begin());
  orders_.push_back(std::move(order));
}

void Inbox::receive(const InputStream& stream, Wire wire, const Received& received) {
  const std::size_t last = stream.for_all ? contexts_.size() : stream.vehicle + 1;
  for (std::size_t v = stream.vehicle; v < last; ++v) {
    InputStream own = stream;
    own.vehicle = v;
    std::string reason;
    auto order = order_of(own, wire, received, contexts_[v], reason);
    if (!order) {
      const std::lock_guard lock(mutex_);
      ++refused_.count;
      refused_.last = reason;
      if (refused_topics_.insert(stream.topic.name).second) new_reasons_.push_back(reason);
      return;
    }
    push(std::move(*order));
  }
}

std::vector<Order> Inbox::take() {
  const std::lock_guard lock(mutex_);
  return std::exchange(orders_, {});
}

Inbox::Refused Inbox::refused() const {
  const std::lock_guard lock(mutex_);
  return refused_;
}

std::vector<std::string> Inbox::take_new_reasons() {
  const std::lock_guard lock(mutex_);
  return std::exchange(new_reasons_, {});
}

}  // namespace pointflight
