#pragma once

#include <string>
#include <vector>

#include "pointflight/core/settings.hpp"
#include "pointflight/core/time.hpp"
#include "pointflight/vehicle/airframe.hpp"
#include "pointflight/vehicle/command.hpp"

namespace pointflight {

/// Coordinates of a scenario are no larger, m: those of a UTM zone fit.
inline constexpr double kFarthest = 1e7;

/// What a line of a scenario commands: `name_of`, and two kinds of trajectories.
enum class CommandKind {
  kRotorSpeeds,   ///< `rotors`
  kBodyRates,     ///< `rates_deg`, `thrust`
  kAttitude,      ///< `rpy_deg`, `thrust`
  kAcceleration,  ///< `vector`, heading
  kVelocity,      ///< `vector`, heading
  kPosition,      ///< `vector`, `feed_forward`, heading
  kPolynomial,    ///< A trajectory of `file`.
  kBSpline,       ///< A trajectory of the control points in `file`.
  kWaypoint,      ///< `vector`
  kTakeOff,       ///< `height`, `speed`
  kLand,          ///< `speed`
  kHover,         ///< Stays where it is.
  kArm,           ///< Rotors may turn.
  kDisarm,        ///< Rotors off.
};

/// One line of a scenario's `commands`: what a vehicle is told, and when. Levels that must be
/// repeated are, until the next one.
struct CommandSettings {
  double time = 0.0;                         ///< s
  CommandKind kind = CommandKind::kHover;    ///< What it asks for.
  Vector3d vector = Vector3d::Zero();        ///< Acceleration, velocity or position.
  Vector3d rates_deg = Vector3d::Zero();     ///< Of body rates, deg/s.
  Vector3d feed_forward = Vector3d::Zero();  ///< Velocity of a position command, m/s.
  Vector3d rpy_deg = Vector3d::Zero();       ///< Of an attitude command.
  /// Heading of acceleration, velocity and position, from world x towards y.
  double yaw_deg = 0.0;
  double yaw_rate_deg = 0.0;   ///< Feed-forward, deg/s.
  double thrust = 0.0;         ///< N; 0: the weight.
  std::vector<double> rotors;  ///< rad/s
  double height = 1.5;         ///< Of a take-off, m.
  double speed = 1.0;          ///< Of a take-off or landing, m/s.
  std::string file;            ///< CSV of a trajectory.
  std::int64_t degree = 3;     ///< Of a B-spline.
  double interval = 1.0;       ///< Between its knots, s.
};

/// The keys of one entry of `commands`.
void describe(SettingsVisitor& visitor, CommandSettings& settings);

/// The command of a line. Throws InputError (files).
Command command_of(const CommandSettings& settings,
                   const VehicleSettings& vehicle,
                   const MotionLimits& motion,
                   const std::string& folder);

}  // namespace pointflight
