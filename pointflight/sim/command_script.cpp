#include "pointflight/sim/command_script.hpp"

#include <array>

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
  v.value({"vector", "", "acceleration m/s^2, velocity m/s, position or waypoint m", -kFar, kFar},
          s.vector);
  v.value({"rates_deg", "deg/s", "about the body's axes, of body_rates", -36000, 36000},
          s.rates_deg);
  v.value({"feed_forward", "m/s", "velocity of a position command", -100, 100}, s.feed_forward);
  v.value({"rpy_deg", "deg", "of an attitude command", -360, 360}, s.rpy_deg);
  v.value({"yaw_deg", "deg", "heading of acceleration, velocity, position", -360, 360}, s.yaw_deg);
  v.value({"yaw_rate_deg", "deg/s", "feed-forward", -720, 720}, s.yaw_rate_deg);
  v.value({"thrust", "N", "of body_rates and attitude; 0: the weight", 0, 1e5}, s.thrust);
  v.value({"rotors", "rad/s", "speeds of rotor_speeds", 0, 1e5}, s.rotors);
  v.value({"height", "m", "of take_off", 0.01, 1e4}, s.height);
  v.value({"speed", "m/s", "of take_off and land", 0.01, 20}, s.speed);
  v.value({"file", "", "CSV of a polynomial or of a B-spline's control points"}, s.file);
  v.value({"degree", "", "of the B-spline", 1, 7}, s.degree);
  v.value({"interval", "s", "between the B-spline's knots", 0.001, 1000}, s.interval);
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
