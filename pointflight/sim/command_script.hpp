#pragma once

#include <string>
#include <vector>

#include "pointflight/core/registry.hpp"
#include "pointflight/core/settings.hpp"
#include "pointflight/core/time.hpp"
#include "pointflight/vehicle/airframe.hpp"
#include "pointflight/vehicle/command.hpp"

namespace pointflight {

/// Coordinates of a scenario are no larger, m: those of a UTM zone fit.
inline constexpr double kFarthest = 1e7;

struct CommandSettings;

/// What a line's command is made with beside its own keys.
struct CommandContext {
  const VehicleSettings& vehicle;  ///< Who gets it.
  const MotionLimits& motion;      ///< How it flies to positions.
  const std::string& folder;       ///< That relative paths of files start from.
};

/// What a line of a scenario can command: a row of a table. To add one, add a row; it says which
/// keys the line has.
struct ScriptedCommand {
  static constexpr const char* kWhat = "command";  ///< In messages.
  /// The commands by their names; trajectories are there as "polynomial" and "b_spline".
  static Registry<ScriptedCommand>& table();

  std::string name;   ///< In files.
  unsigned keys = 0;  ///< Of the line: bits of command_script.cpp.
  /// Throws InputError (files).
  Command (*make)(const CommandSettings& settings, const CommandContext& context) = nullptr;
};

/// One line of a scenario's `commands`: what a vehicle is told, and when. Levels that must be
/// repeated are, until the next one.
struct CommandSettings {
  double time = 0.0;                         ///< s
  Choice<ScriptedCommand> kind = "hover";    ///< What it asks for.
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

/// True if the line's `vector` is a position: each of a vehicle's copies has its own.
bool moves_with_copies(const CommandSettings& settings);

}  // namespace pointflight
