#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "pointflight/core/time.hpp"
#include "pointflight/vehicle/command.hpp"
#include "pointflight/vehicle/controller.hpp"

namespace pointflight {

/// What an autopilot does and remembers: a value.
struct AutopilotState {
  Command command = HoverCommand{};  ///< The last that was taken; hover after a timeout.
  SimTime since;                     ///< When the command was given.
  std::shared_ptr<const Trajectory> trajectory;  ///< Followed since `since`; null: none.
  bool armed = true;                    ///< False: rotors are off, whatever the command says.
  std::optional<PositionCommand> hold;  ///< Where it hovers, once it is slow.
  PositionCommand reference;            ///< What it last asked for; for records.
  ControllerMemory memory;              ///< Of the control loops.
  std::uint64_t rejected = 0;           ///< Commands that were not taken.
  std::uint64_t timeouts = 0;           ///< Times the watchdog made it hover.
  std::string last_rejection;           ///< Why, in words.

  /// Counts a command that is not taken; returns the reason.
  std::string reject(std::string reason);
};

/// The one place where commands become setpoints and setpoints rotor speeds.
class Autopilot {
 public:
  /// Without a command for `command_timeout` (0: for ever) one that must be repeated ends in hover.
  /// Throws InputError if the vehicle's innermost command is none of `setpoint_names`.
  Autopilot(const VehicleSettings& settings, Duration command_timeout);

  /// Hovering at a state, armed; or on the ground with rotors off.
  [[nodiscard]] AutopilotState start(const RigidBodyState& body, bool landed) const;

  /// Takes a command from now on. One that is not finite, below what the vehicle takes, or of the
  /// wrong size is not taken: counted, and the reason returned.
  std::optional<std::string> give(AutopilotState& state,
                                  const Command& command,
                                  SimTime now,
                                  const RigidBodyState& body) const;

  /// Rotor speed commands (rad/s; 0: off) for the control period of `dt` seconds that starts now.
  /// `landed`: the ground carries it, which ends a landing.
  std::vector<double> rotor_speeds(
      AutopilotState& state, const RigidBodyState& body, bool landed, SimTime now, double dt) const;

  /// Why the vehicle cannot take a command, if so.
  [[nodiscard]] std::optional<std::string> objection(const Command& command) const;

  /// As given to the constructor.
  [[nodiscard]] const VehicleSettings& settings() const { return settings_; }

 private:
  [[nodiscard]] Setpoint setpoint(AutopilotState& state,
                                  const RigidBodyState& body,
                                  SimTime now,
                                  double dt) const;
  [[nodiscard]] Setpoint hover(AutopilotState& state, const RigidBodyState& body) const;

  VehicleSettings settings_;
  Duration command_timeout_;
  std::size_t lowest_command_;  ///< Index in `Setpoint`.
  std::unique_ptr<Controller> controller_;
};

}  // namespace pointflight
