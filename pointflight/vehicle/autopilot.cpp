#include "pointflight/vehicle/autopilot.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <concepts>
#include <type_traits>

#include "pointflight/core/constants.hpp"
#include "pointflight/core/registry.hpp"
#include "pointflight/geometry/rotation.hpp"

namespace pointflight {
namespace {

constexpr std::size_t kRepeated = std::variant_size_v<Setpoint>;  // the first of Command
constexpr double kSlow = 0.15;    // m/s: below, hover holds a position
constexpr double kDescent = 1e4;  // m: a landing ends before

constexpr double kLargest =
    1e9;  // of any number in a command: squares of larger ones overflow soon

constexpr int kLooks = 64;  // at a trajectory

/// False if a number of the command is not finite or out of range.
struct Finite {
  static bool all(const Vector3d& v) {
    return v.allFinite() && v.cwiseAbs().maxCoeff() <= kLargest;
  }
  static bool all(double value) { return std::abs(value) <= kLargest; }
  bool operator()(const RotorSpeedCommand& c) const {
    for (const double speed : c.speeds) {
      if (!all(speed) || speed < 0.0) return false;  // they turn one way; a motor clips the rest
    }
    return true;
  }
  bool operator()(const BodyRateCommand& c) const { return all(c.omega_body) && all(c.thrust); }
  bool operator()(const AttitudeCommand& c) const {
    return all(c.q_world_body.vec()) && all(c.q_world_body.w()) && c.q_world_body.norm() > 1e-6 &&
           all(c.omega_body) && all(c.thrust);
  }
  bool operator()(const AccelerationCommand& c) const {
    return all(c.a_world) && all(c.yaw) && all(c.yaw_rate);
  }
  bool operator()(const VelocityCommand& c) const {
    return all(c.v_world) && all(c.yaw) && all(c.yaw_rate);
  }
  bool operator()(const PositionCommand& c) const {
    return all(c.p_world) && all(c.v_world) && all(c.a_world) && all(c.jerk_world) && all(c.yaw) &&
           all(c.yaw_rate);
  }
  /// Looks at some instants: a trajectory of the user's own may be anything.
  bool operator()(const TrajectoryCommand& c) const {
    if (!c.trajectory) return false;
    const double duration = c.trajectory->duration();
    if (!all(duration) || duration < 0.0) return false;
    for (int i = 0; i <= kLooks; ++i) {
      if (!(*this)(c.trajectory->at(duration * i / kLooks))) return false;
    }
    return true;
  }
  bool operator()(const WaypointCommand& c) const {
    for (const Vector3d& p : c.mission.waypoints) {
      if (!all(p)) return false;
    }
    const MotionLimits& m = c.mission.motion;
    for (const double limit : {m.speed, m.acceleration, m.jerk, c.mission.yaw_rate_deg}) {
      if (!all(limit) || limit <= 0.0) return false;
    }
    return all(c.mission.hold) && c.mission.hold >= 0.0 && all(c.mission.final_yaw.value_or(0.0));
  }
  bool operator()(const TakeOffCommand& c) const {
    return all(c.height) && c.height > 0.0 && c.speed > 0.0 && all(c.speed);
  }
  bool operator()(const LandCommand& c) const { return c.speed > 0.0 && all(c.speed); }
  template <class Other>
  bool operator()(const Other& /*command*/) const {
    return true;
  }
};

/// A vertical move from a position.
class Climb : public Trajectory {
 public:
  Climb(const Vector3d& from, double height, double yaw, double speed)
      : from_(from),
        sign_(height < 0.0 ? -1.0 : 1.0),
        yaw_(yaw),
        move_(std::abs(height), {speed, std::max(0.5, speed), 2.0}) {}

  [[nodiscard]] PositionCommand at(double t) const override {
    const SmoothMove::Sample s = move_.at(t);
    const Vector3d up(0.0, 0.0, sign_);
    PositionCommand command;
    command.p_world = from_ + s.position * up;
    command.v_world = s.speed * up;
    command.a_world = s.acceleration * up;
    command.jerk_world = s.jerk * up;
    command.yaw = yaw_;
    return command;
  }
  [[nodiscard]] double duration() const override { return move_.duration(); }

 private:
  Vector3d from_;
  double sign_;
  double yaw_;
  SmoothMove move_;
};

/// The velocity in the world and the heading that it goes with.
VelocityCommand in_world(const VelocityCommand& command,
                         const AutopilotState& state,
                         const RigidBodyState& body,
                         double dt) {
  VelocityCommand world = command;
  if (command.turn) world.yaw = wrap_angle(state.reference.yaw + command.yaw_rate * dt);
  if (command.in_body) {
    const Quaterniond level = quaternion_from_rpy(0.0, 0.0, yaw_of(body.q_world_body));
    world.v_world = level * command.v_world;
  }
  return world;
}

std::size_t index_of_setpoint(std::string_view name) {
  const auto names = setpoint_names();
  const auto found = std::find(names.begin(), names.end(), name);
  if (found == names.end()) throw_unknown("command", name, {names.begin(), names.end()});
  return static_cast<std::size_t>(found - names.begin());
}

/// True for a take-off, landing or goal that is said again, as some programs do many times a
/// second.
bool is_under_way(const AutopilotState& state, const Command& command) {
  if (!state.trajectory || command.index() != state.command.index()) return false;
  return std::visit(
      [&](const auto& c) {
        using C = std::decay_t<decltype(c)>;
        if constexpr (std::equality_comparable<C>) {
          return c == std::get<C>(state.command);
        } else {
          return false;
        }
      },
      command);
}

}  // namespace

std::string AutopilotState::reject(std::string reason) {
  ++rejected;
  return last_rejection = std::move(reason);
}

Autopilot::Autopilot(const VehicleSettings& settings, Duration command_timeout)
    : settings_(settings),
      command_timeout_(command_timeout),
      lowest_command_(index_of_setpoint(settings.lowest_command)),
      controller_(make_controller(settings.controller.kind, settings)) {}

AutopilotState Autopilot::start(const RigidBodyState& body, bool landed) const {
  AutopilotState state;
  state.armed = !landed;
  PositionCommand here;
  here.p_world = body.p_world;
  here.yaw = yaw_of(body.q_world_body);
  state.hold = here;
  state.reference = here;
  return state;
}

std::optional<std::string> Autopilot::objection(const Command& command) const {
  if (!std::visit(Finite{}, command)) {
    return fmt::format("a {} command with a number that is not finite or out of range",
                       name_of(command));
  }
  if (const auto* rotors = std::get_if<RotorSpeedCommand>(&command)) {
    if (rotors->speeds.size() != settings_.rotors.size()) {
      return fmt::format("{} rotor speeds for a vehicle with {} rotors",
                         rotors->speeds.size(),
                         settings_.rotors.size());
    }
  }
  if (command.index() < lowest_command_) {
    return fmt::format("this vehicle takes no {} commands; the innermost are {}",
                       name_of(command),
                       settings_.lowest_command);
  }
  return std::nullopt;
}

std::optional<std::string> Autopilot::give(AutopilotState& state,
                                           const Command& command,
                                           SimTime now,
                                           const RigidBodyState& body) const {
  if (const auto reason = objection(command)) return state.reject(*reason);
  if (is_under_way(state, command)) return std::nullopt;
  // moves start from where it was told to be, so that nothing jumps; from where it is, else
  const bool held = state.hold.has_value() || state.trajectory != nullptr;
  const Vector3d from = held ? state.reference.p_world : body.p_world;
  const double yaw = held ? state.reference.yaw : yaw_of(body.q_world_body);
  state.command = command;
  state.since = now;
  state.trajectory = nullptr;
  if (const auto* c = std::get_if<TrajectoryCommand>(&command)) {
    state.trajectory = c->trajectory;
  } else if (const auto* w = std::get_if<WaypointCommand>(&command)) {
    MissionSettings mission = w->mission;
    for (Vector3d& p : mission.waypoints) {
      if (w->keep_height) p.z() = from.z();
    }
    state.trajectory = std::make_shared<Mission>(from, yaw, mission);
  } else if (const auto* t = std::get_if<TakeOffCommand>(&command)) {
    state.armed = true;
    state.memory = {};
    state.trajectory = std::make_shared<Climb>(from, t->height, yaw, t->speed);
  } else if (const auto* l = std::get_if<LandCommand>(&command)) {
    state.trajectory = std::make_shared<Climb>(from, -kDescent, yaw, l->speed);
  } else if (std::holds_alternative<ArmCommand>(command)) {
    state.armed = true;
    state.memory = {};
  } else if (std::holds_alternative<DisarmCommand>(command)) {
    state.armed = false;
  }
  const bool stays =
      std::holds_alternative<HoverCommand>(command) || std::holds_alternative<ArmCommand>(command);
  if (!stays || !held) state.hold.reset();
  return std::nullopt;
}

Setpoint Autopilot::hover(AutopilotState& state, const RigidBodyState& body) const {
  if (!state.hold && body.v_world.norm() < kSlow) {
    PositionCommand here;
    here.p_world = body.p_world;
    here.yaw = state.reference.yaw;
    state.hold = here;
  }
  if (state.hold) return *state.hold;
  return VelocityCommand{Vector3d::Zero(), state.reference.yaw, 0.0};
}

Setpoint Autopilot::setpoint(AutopilotState& state,
                             const RigidBodyState& body,
                             SimTime now,
                             double dt) const {
  const bool repeated = state.command.index() < kRepeated;
  if (repeated && command_timeout_.count() > 0 && now - state.since > command_timeout_) {
    ++state.timeouts;
    state.command = HoverCommand{};
    state.hold.reset();
    state.reference.yaw = yaw_of(body.q_world_body);
  }
  if (state.trajectory) return state.trajectory->at(to_seconds(now - state.since));
  return std::visit(
      [&](const auto& c) -> Setpoint {
        using C = std::decay_t<decltype(c)>;
        if constexpr (std::is_same_v<C, AttitudeCommand>) {
          AttitudeCommand unit = c;
          unit.q_world_body.normalize();
          return unit;
        } else if constexpr (std::is_same_v<C, VelocityCommand>) {
          return in_world(c, state, body, dt);
        } else if constexpr (std::is_constructible_v<Setpoint, C>) {
          return c;
        } else {
          return hover(state, body);
        }
      },
      state.command);
}

std::vector<double> Autopilot::rotor_speeds(
    AutopilotState& state, const RigidBodyState& body, bool landed, SimTime now, double dt) const {
  if (landed && std::holds_alternative<LandCommand>(state.command)) {
    give(state, DisarmCommand{}, now, body);
  }
  if (!state.armed) {
    state.reference = {};
    state.reference.p_world = body.p_world;
    state.reference.yaw = yaw_of(body.q_world_body);
    return std::vector<double>(settings_.rotors.size(), 0.0);
  }
  const Setpoint wanted = setpoint(state, body, now, dt);
  // what is recorded as the command: what of it there is
  PositionCommand& r = state.reference;
  if (const auto* p = std::get_if<PositionCommand>(&wanted)) {
    r = *p;
  } else {
    const double yaw = r.yaw;
    r = {};
    r.p_world = body.p_world;
    r.v_world = body.v_world;
    r.yaw = yaw;
    if (const auto* v = std::get_if<VelocityCommand>(&wanted)) {
      r.v_world = v->v_world;
      r.yaw = v->yaw;
    } else if (const auto* a = std::get_if<AccelerationCommand>(&wanted)) {
      r.a_world = a->a_world;
      r.yaw = a->yaw;
    } else {
      r.yaw = yaw_of(body.q_world_body);
    }
  }
  if (landed && std::holds_alternative<ArmCommand>(state.command)) {
    return std::vector<double>(settings_.rotors.size(), settings_.rotor.speed_min);
  }
  return controller_->update(body, wanted, dt, state.memory);
}

}  // namespace pointflight
