#pragma once

#include <memory>
#include <span>
#include <string_view>
#include <variant>
#include <vector>

#include "pointflight/geometry/types.hpp"
#include "pointflight/vehicle/mission.hpp"
#include "pointflight/vehicle/trajectory.hpp"

namespace pointflight {

/// Speeds of all rotors, rad/s, in the order of the vehicle file.
struct RotorSpeedCommand {
  static constexpr std::string_view kName = "rotor_speeds";  ///< `name_of`
  std::vector<double> speeds;                                ///< One a rotor; 0: off.
};
/// Body rates (rad/s) and total thrust along body z (N).
struct BodyRateCommand {
  static constexpr std::string_view kName = "body_rates";  ///< `name_of`
  Vector3d omega_body = Vector3d::Zero();                  ///< rad/s, about the body's axes.
  double thrust = 0.0;                                     ///< N
};
/// Attitude and total thrust along body z (N); rates are feed-forward.
struct AttitudeCommand {
  static constexpr std::string_view kName = "attitude";  ///< `name_of`
  Quaterniond q_world_body = Quaterniond::Identity();    ///< Attitude: body axes in the world.
  double thrust = 0.0;                                   ///< N
  Vector3d omega_body = Vector3d::Zero();                ///< Feed-forward, rad/s.
};
/// Acceleration without gravity (zero hovers), m/s^2, and heading.
struct AccelerationCommand {
  static constexpr std::string_view kName = "acceleration";  ///< `name_of`
  Vector3d a_world = Vector3d::Zero();                       ///< m/s^2, world.
  double yaw = 0.0;                                          ///< rad, from world x towards y.
  double yaw_rate = 0.0;                                     ///< Feed-forward, rad/s.
};
/// Velocity, m/s, and heading.
struct VelocityCommand {
  static constexpr std::string_view kName = "velocity";  ///< `name_of`
  Vector3d v_world = Vector3d::Zero();                   ///< m/s; in the world, but see `in_body`.
  double yaw = 0.0;                                      ///< rad, from world x towards y.
  double yaw_rate = 0.0;                                 ///< rad/s; feed-forward, but see `turn`.
  bool turn = false;     ///< Turn at `yaw_rate` from the present heading on; `yaw` is not used.
  bool in_body = false;  ///< `v_world` is along the level body axes: ahead, left, up.
};

/// What a controller is asked for over a control period, the innermost first.
using Setpoint = std::variant<RotorSpeedCommand,
                              BodyRateCommand,
                              AttitudeCommand,
                              AccelerationCommand,
                              VelocityCommand,
                              PositionCommand>;

/// Follow a trajectory, from its start on.
struct TrajectoryCommand {
  static constexpr std::string_view kName = "trajectory";  ///< `name_of`
  /// Never null; it starts when the command is taken.
  std::shared_ptr<const Trajectory> trajectory;
};
/// Fly through waypoints from where the vehicle is, straight and at rest at each.
struct WaypointCommand {
  static constexpr std::string_view kName = "waypoints";  ///< `name_of`
  MissionSettings mission;   ///< Its waypoints are in the world, m; starts where the vehicle is.
  bool keep_height = false;  ///< Waypoints are at the present height, whatever their z.

  /// Two that are equal are one order said twice.
  bool operator==(const WaypointCommand&) const = default;
};
/// Rise by `height` (m) from the present position; arms.
struct TakeOffCommand {
  static constexpr std::string_view kName = "take_off";  ///< `name_of`
  double height = 1.5;                                   ///< Above the present position, m; over 0.
  double speed = 1.0;                                    ///< m/s

  /// Two that are equal are one order said twice.
  bool operator==(const TakeOffCommand&) const = default;
};
/// Come down until something carries the vehicle, then stop the rotors.
struct LandCommand {
  static constexpr std::string_view kName = "land";  ///< `name_of`
  double speed = 0.5;                                ///< m/s

  /// Two that are equal are one order said twice.
  bool operator==(const LandCommand&) const = default;
};
/// Brake and stay.
struct HoverCommand {
  static constexpr std::string_view kName = "hover";  ///< `name_of`
};
/// Rotors idle on the ground; in the air: hover.
struct ArmCommand {
  static constexpr std::string_view kName = "arm";  ///< `name_of`
};
/// Rotors off, wherever it is.
struct DisarmCommand {
  static constexpr std::string_view kName = "disarm";  ///< `name_of`
};

/// All that a vehicle can be told. The first six must be repeated (`Autopilot`'s watchdog); the
/// others hold until the next command; take-offs, landings and waypoints are not begun anew when
/// they are said again under way.
using Command = std::variant<RotorSpeedCommand,
                             BodyRateCommand,
                             AttitudeCommand,
                             AccelerationCommand,
                             VelocityCommand,
                             PositionCommand,
                             TrajectoryCommand,
                             WaypointCommand,
                             TakeOffCommand,
                             LandCommand,
                             HoverCommand,
                             ArmCommand,
                             DisarmCommand>;

/// "velocity", "take_off", ...
std::string_view name_of(const Command& command);

/// Of all setpoints, the innermost first, as `name_of`.
std::span<const std::string_view> setpoint_names();

}  // namespace pointflight
