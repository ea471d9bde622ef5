#include "pointflight/sim/command_script.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <initializer_list>

#include "pointflight/core/constants.hpp"
#include "pointflight/core/resources.hpp"
#include "pointflight/geometry/rotation.hpp"

namespace pointflight {
namespace {

constexpr Named<CommandKind> kCommandKinds[] = {{CommandKind::kRotorSpeeds, "rotor_speeds"},
                                                {CommandKind::kBodyRates, "body_rates"},
                                                {CommandKind::kAttitude, "attitude"},
                                                {CommandKind::kAcceleration, "acceleration"},
                                                {CommandKind::kVelocity, "velocity"},
                                                {CommandKind::kPosition, "position"},
                                                {CommandKind::kPolynomial, "polynomial"},
                                                {CommandKind::kBSpline, "b_spline"},
                                                {CommandKind::kWaypoint, "waypoint"},
                                                {CommandKind::kTakeOff, "take_off"},
                                                {CommandKind::kLand, "land"},
                                                {CommandKind::kHover, "hover"},
                                                {CommandKind::kArm, "arm"},
                                                {CommandKind::kDisarm, "disarm"}};

}  // namespace

void describe(SettingsVisitor& v, CommandSettings& s) {
  v.value({"time", "s", "when it is given", 0, 1e6}, s.time);
  v.choice({"kind", "", "what is commanded"}, s.kind, kCommandKinds);
  // the keys of each kind
  const auto for_kinds = [&](std::initializer_list<CommandKind> kinds, const auto& keys) {
    const bool holds = std::find(kinds.begin(), kinds.end(), s.kind) != kinds.end();
    std::vector<std::string_view> names;
    for (const CommandKind kind : kinds) names.push_back(name_in(kCommandKinds, kind));
    v.only_if(holds, fmt::format("kind: {}", fmt::join(names, ", ")), keys);
  };
  const bool has_vector = s.kind == CommandKind::kAcceleration ||
                          s.kind == CommandKind::kVelocity || s.kind == CommandKind::kPosition ||
                          s.kind == CommandKind::kWaypoint;
  v.only_if(has_vector,
            "kind: acceleration, velocity, position, waypoint; body_rates has rates_deg",
            [&](SettingsVisitor& w) {
              w.value({"vector",
                       "",
                       "acceleration m/s^2, velocity m/s, position or waypoint m",
                       -kFarthest,
                       kFarthest},
                      s.vector);
            });
  for_kinds({CommandKind::kBodyRates}, [&](SettingsVisitor& w) {
    w.value({"rates_deg", "deg/s", "about the body's axes", -36000, 36000}, s.rates_deg);
  });
  for_kinds({CommandKind::kPosition}, [&](SettingsVisitor& w) {
    w.value({"feed_forward", "m/s", "velocity of the command", -100, 100}, s.feed_forward);
  });
  for_kinds({CommandKind::kAttitude}, [&](SettingsVisitor& w) {
    w.value({"rpy_deg", "deg", "the attitude", -360, 360}, s.rpy_deg);
  });
  for_kinds({CommandKind::kAcceleration, CommandKind::kVelocity, CommandKind::kPosition},
            [&](SettingsVisitor& w) {
              w.value({"yaw_deg", "deg", "heading", -360, 360}, s.yaw_deg);
              w.value({"yaw_rate_deg", "deg/s", "feed-forward", -720, 720}, s.yaw_rate_deg);
            });
  for_kinds({CommandKind::kBodyRates, CommandKind::kAttitude}, [&](SettingsVisitor& w) {
    w.value({"thrust", "N", "0: the weight", 0, 1e5}, s.thrust);
  });
  for_kinds({CommandKind::kRotorSpeeds}, [&](SettingsVisitor& w) {
    w.value({"rotors", "rad/s", "of each", 0, 1e5}, s.rotors);
  });
  for_kinds({CommandKind::kTakeOff}, [&](SettingsVisitor& w) {
    w.value({"height", "m", "to rise by", 0.01, 1e4}, s.height);
  });
  for_kinds({CommandKind::kTakeOff, CommandKind::kLand}, [&](SettingsVisitor& w) {
    w.value({"speed", "m/s", "up or down", 0.01, 20}, s.speed);
  });
  for_kinds({CommandKind::kPolynomial, CommandKind::kBSpline}, [&](SettingsVisitor& w) {
    w.value({"file", "", "CSV of a polynomial or of a B-spline's control points"}, s.file);
  });
  for_kinds({CommandKind::kBSpline}, [&](SettingsVisitor& w) {
    w.value({"degree", "", "of the B-spline", 1, 7}, s.degree);
    w.value({"interval", "s", "between the B-spline's knots", 0.001, 1000}, s.interval);
  });
}

Command command_of(const CommandSettings& s,
                   const VehicleSettings& vehicle,
                   const MotionLimits& motion,
                   const std::string& folder) {
  const double yaw = s.yaw_deg * kDegree;
  const double yaw_rate = s.yaw_rate_deg * kDegree;
  const double thrust = s.thrust > 0.0 ? s.thrust : vehicle.mass * kGravity;
  if (s.kind == CommandKind::kRotorSpeeds) return RotorSpeedCommand{s.rotors};
  if (s.kind == CommandKind::kBodyRates) return BodyRateCommand{s.rates_deg * kDegree, thrust};
  if (s.kind == CommandKind::kAttitude) {
    const Vector3d rpy = s.rpy_deg * kDegree;
    return AttitudeCommand{
        quaternion_from_rpy(rpy.x(), rpy.y(), rpy.z()), thrust, Vector3d::Zero()};
  }
  if (s.kind == CommandKind::kAcceleration) return AccelerationCommand{s.vector, yaw, yaw_rate};
  if (s.kind == CommandKind::kVelocity) return VelocityCommand{s.vector, yaw, yaw_rate};
  if (s.kind == CommandKind::kPosition) {
    PositionCommand command;
    command.p_world = s.vector;
    command.v_world = s.feed_forward;
    command.yaw = yaw;
    command.yaw_rate = yaw_rate;
    return command;
  }
  if (s.kind == CommandKind::kPolynomial) {
    return TrajectoryCommand{PolynomialTrajectory::read(resolve_path(s.file, folder))};
  }
  if (s.kind == CommandKind::kBSpline) {
    return TrajectoryCommand{BSplineTrajectory::read(
        resolve_path(s.file, folder), static_cast<int>(s.degree), s.interval)};
  }
  if (s.kind == CommandKind::kWaypoint) {
    MissionSettings mission;
    mission.motion = motion;
    mission.waypoints = {s.vector};
    return WaypointCommand{mission};
  }
  if (s.kind == CommandKind::kTakeOff) return TakeOffCommand{s.height, s.speed};
  if (s.kind == CommandKind::kLand) return LandCommand{s.speed};
  if (s.kind == CommandKind::kArm) return ArmCommand{};
  if (s.kind == CommandKind::kDisarm) return DisarmCommand{};
  return HoverCommand{};
}

}  // namespace pointflight
