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

constexpr std::array<std::string_view, 14> kKinds = {"rotor_speeds",
                                                     "body_rates",
                                                     "attitude",
                                                     "acceleration",
                                                     "velocity",
                                                     "position",
                                                     "polynomial",
                                                     "b_spline",
                                                     "waypoint",
                                                     "take_off",
                                                     "land",
                                                     "hover",
                                                     "arm",
                                                     "disarm"};
constexpr double kFar = kFarthest;

}  // namespace

void describe(SettingsVisitor& v, CommandSettings& s) {
  v.value({"time", "s", "when it is given", 0, 1e6}, s.time);
  v.choice({"kind", "", "what is commanded"}, s.kind, kKinds);
  // the keys of each kind
  const auto for_kinds = [&](std::initializer_list<std::string_view> kinds, const auto& keys) {
    const bool holds = std::find(kinds.begin(), kinds.end(), s.kind) != kinds.end();
    v.only_if(holds, fmt::format("kind: {}", fmt::join(kinds, ", ")), keys);
  };
  const bool has_vector = s.kind == "acceleration" || s.kind == "velocity" ||
                          s.kind == "position" || s.kind == "waypoint";
  v.only_if(
      has_vector,
      "kind: acceleration, velocity, position, waypoint; body_rates has rates_deg",
      [&](SettingsVisitor& w) {
        w.value(
            {"vector", "", "acceleration m/s^2, velocity m/s, position or waypoint m", -kFar, kFar},
            s.vector);
      });
  for_kinds({"body_rates"}, [&](SettingsVisitor& w) {
    w.value({"rates_deg", "deg/s", "about the body's axes", -36000, 36000}, s.rates_deg);
  });
  for_kinds({"position"}, [&](SettingsVisitor& w) {
    w.value({"feed_forward", "m/s", "velocity of the command", -100, 100}, s.feed_forward);
  });
  for_kinds({"attitude"}, [&](SettingsVisitor& w) {
    w.value({"rpy_deg", "deg", "the attitude", -360, 360}, s.rpy_deg);
  });
  for_kinds({"acceleration", "velocity", "position"}, [&](SettingsVisitor& w) {
    w.value({"yaw_deg", "deg", "heading", -360, 360}, s.yaw_deg);
    w.value({"yaw_rate_deg", "deg/s", "feed-forward", -720, 720}, s.yaw_rate_deg);
  });
  for_kinds({"body_rates", "attitude"}, [&](SettingsVisitor& w) {
    w.value({"thrust", "N", "0: the weight", 0, 1e5}, s.thrust);
  });
  for_kinds({"rotor_speeds"}, [&](SettingsVisitor& w) {
    w.value({"rotors", "rad/s", "of each", 0, 1e5}, s.rotors);
  });
  for_kinds({"take_off"}, [&](SettingsVisitor& w) {
    w.value({"height", "m", "to rise by", 0.01, 1e4}, s.height);
  });
  for_kinds({"take_off", "land"}, [&](SettingsVisitor& w) {
    w.value({"speed", "m/s", "up or down", 0.01, 20}, s.speed);
  });
  for_kinds({"polynomial", "b_spline"}, [&](SettingsVisitor& w) {
    w.value({"file", "", "CSV of a polynomial or of a B-spline's control points"}, s.file);
  });
  for_kinds({"b_spline"}, [&](SettingsVisitor& w) {
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
  if (s.kind == "rotor_speeds") return RotorSpeedCommand{s.rotors};
  if (s.kind == "body_rates") return BodyRateCommand{s.rates_deg * kDegree, thrust};
  if (s.kind == "attitude") {
    const Vector3d rpy = s.rpy_deg * kDegree;
    return AttitudeCommand{
        quaternion_from_rpy(rpy.x(), rpy.y(), rpy.z()), thrust, Vector3d::Zero()};
  }
  if (s.kind == "acceleration") return AccelerationCommand{s.vector, yaw, yaw_rate};
  if (s.kind == "velocity") return VelocityCommand{s.vector, yaw, yaw_rate};
  if (s.kind == "position") {
    PositionCommand command;
    command.p_world = s.vector;
    command.v_world = s.feed_forward;
    command.yaw = yaw;
    command.yaw_rate = yaw_rate;
    return command;
  }
  if (s.kind == "polynomial") {
    return TrajectoryCommand{PolynomialTrajectory::read(resolve_path(s.file, folder))};
  }
  if (s.kind == "b_spline") {
    return TrajectoryCommand{BSplineTrajectory::read(
        resolve_path(s.file, folder), static_cast<int>(s.degree), s.interval)};
  }
  if (s.kind == "waypoint") {
    MissionSettings mission;
    mission.motion = motion;
    mission.waypoints = {s.vector};
    return WaypointCommand{mission};
  }
  if (s.kind == "take_off") return TakeOffCommand{s.height, s.speed};
  if (s.kind == "land") return LandCommand{s.speed};
  if (s.kind == "arm") return ArmCommand{};
  if (s.kind == "disarm") return DisarmCommand{};
  return HoverCommand{};
}

}  // namespace pointflight
