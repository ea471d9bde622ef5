#pragma once

#include <any>
#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "pointflight/vehicle/airframe.hpp"
#include "pointflight/vehicle/command.hpp"
#include "pointflight/vehicle/state.hpp"

namespace pointflight {

/// Which limits a controller cut a demand to.
struct LimitsReached {
  bool speed = false;         ///< Of velocity and position setpoints.
  bool acceleration = false;  ///< Horizontal or climbing, of the position loop.
  bool tilt = false;          ///< The attitude for the demanded acceleration.
  bool rotors = false;        ///< Another thrust than demanded.
};

/// What a controller remembers from one period to the next: a value, so that a run can be saved,
/// restored and branched.
struct ControllerMemory {
  Vector3d disturbance = Vector3d::Zero();  ///< What else accelerates it, as learnt, m/s^2, world.
  /// Velocity (m/s) when the position loop last acted, and the acceleration that it asked for
  /// (m/s^2); world.
  std::optional<std::pair<Vector3d, Vector3d>> expected;
  Vector3d attitude_integral = Vector3d::Zero();  ///< In rad/s^2: gain included.
  Vector3d velocity_integral = Vector3d::Zero();  ///< In m/s^2: gain included.
  double yaw_torque = 0.0;                        ///< Filtered, N m.
  std::size_t level = std::variant_npos;          ///< Of the last setpoint.
  LimitsReached limits;                           ///< Over the last period.
  /// Share of the commanded speed that each rotor turns at, as its speed controller reports; empty:
  /// all of it.
  std::vector<double> rotor_shares;
  bool spins = false;  ///< The rotors that are left cannot hold a heading.
  /// Of the rotors that are left about body z by the last commands, while it spins, kg m^2/s.
  double rotor_momentum = 0.0;
  /// What a controller that a program has added remembers besides: any value that is copied as a
  /// whole.
  std::any own;
};

/// Turns setpoints into rotor speeds. It sees the true state.
///
/// To add one: a file in vehicle/controllers/, one row in the table of controllers.cpp, a
/// step-response test, and its keys with defaults in ControllerSettings. Programs add rows of their
/// own: `ControllerKind::table().add(...)`.
class Controller {
 public:
  virtual ~Controller() = default;

  /// Rotor speed commands (rad/s) for a period of `dt` seconds.
  [[nodiscard]] virtual std::vector<double> update(const RigidBodyState& state,
                                                   const Setpoint& setpoint,
                                                   double dt,
                                                   ControllerMemory& memory) const = 0;
};

/// By name ("cascade", "geometric") or row of `ControllerKind::table`. Throws InputError if the
/// settings are wrong.
std::unique_ptr<Controller> make_controller(const Choice<ControllerKind>& kind,
                                            const VehicleSettings& settings);

}  // namespace pointflight
