#pragma once

#include <limits>
#include <span>
#include <vector>

#include "pointflight/vehicle/airframe.hpp"
#include "pointflight/vehicle/state.hpp"

namespace pointflight {

/// What surrounds a vehicle over a step.
struct FlightConditions {
  Vector3d wind_world = Vector3d::Zero();  ///< m/s
  /// Height of the ground below the body's origin, world z, m.
  double ground_z = -std::numeric_limits<double>::infinity();
  double speed_share = 1.0;  ///< Of the rotors' greatest speed that the battery allows.
  /// Of the mass and inertia in its file that it flies with: a payload that its controller does not
  /// know of.
  double load_share = 1.0;
  /// Of its commanded speed that each rotor reaches, 0 to 1; empty: all of it.
  std::vector<double> rotor_shares;
};

/// Rigid body with rotors (Lee, Leok, McClamroch 2010, with rotor dynamics, drag and gyroscopic
/// torque added):
///
///   m dv/dt = R (sum_i T_i e3 + F_rotor_drag + F_body_drag) - m g e3
///   J dw/dt = sum_i (r_i x F_i + s_i (k_m w_i^2 + J_r dw_i/dt) e3 + s_i J_r w_i w x e3)
///             - K_d |w| w - w x J w
///   d2w_i/dt2 = wn^2 (w_cmd - w_i) - 2 z wn dw_i/dt
///
/// s_i is the sign of the rotor's reaction torque: a rotor with s = +1 turns in the -z sense. Drag
/// is against the air, which moves with the wind. T_i = k_f w_i^2 C_T(J) / C_T(0), and k_m with C_P
/// in the same way, J the advance ratio along the rotor's axis (`RotorModel`). Rotational drag is
/// that of Mueller and D'Andrea (Relaxed hover solutions for multicopters, IJRR 35, 2016). Near the
/// ground thrust grows by 1 / (1 - (R / 4h)^2), h the rotor's height, at least R / 2 (Cheeseman,
/// Bennett, ARC R&M 3021, 1955).
class Multirotor {
 public:
  /// Throws InputError if a figure is not finite or beyond what a vehicle file may say.
  explicit Multirotor(const VehicleSettings& settings);

  /// At rest at a pose, rotors at hover speed.
  [[nodiscard]] VehicleState hover_at(const Vector3d& p_world, double yaw) const;

  /// Advances by `dt` seconds under rotor speed commands (rad/s, clamped to the rotor's limits; 0
  /// or less: off), held over the step: rotor speeds by their closed form, the body by RK4. Without
  /// rotor lag speeds take their commands at once.
  void step(VehicleState& state,
            std::span<const double> rotor_commands,
            double dt,
            const FlightConditions& conditions = {}) const;

  /// What the rotors take from their motors, W.
  [[nodiscard]] double shaft_power(const VehicleState& state,
                                   const FlightConditions& conditions = {}) const;

  /// What the state does: for the IMU.
  [[nodiscard]] BodyAcceleration acceleration(const VehicleState& state,
                                              const FlightConditions& conditions = {}) const;

  /// As given to the constructor.
  [[nodiscard]] const VehicleSettings& settings() const { return settings_; }

 private:
  /// The speed that rotor i goes to.
  [[nodiscard]] double target(std::size_t i,
                              double command,
                              const FlightConditions& conditions) const;

  VehicleSettings settings_;
};

}  // namespace pointflight
