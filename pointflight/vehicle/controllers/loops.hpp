#pragma once

#include "pointflight/vehicle/controller.hpp"
#include "pointflight/vehicle/internal/loop_gains.hpp"
#include "pointflight/vehicle/mixer.hpp"

namespace pointflight {

/// Attitude and thrust that an outer loop asks for.
struct AttitudeDemand {
  Matrix3d R_world_body;
  Vector3d omega_body = Vector3d::Zero();
  double thrust = 0.0;  ///< N along the present body z.
};

/// What all controllers share: everything but how an attitude error becomes a torque.
class LoopController : public Controller {
 public:
  explicit LoopController(const VehicleSettings& settings);

  [[nodiscard]] std::vector<double> update(const RigidBodyState& state,
                                           const Setpoint& setpoint,
                                           double dt,
                                           ControllerMemory& memory) const override;

 protected:
  /// Torque (N m, body) towards an attitude.
  [[nodiscard]] virtual Vector3d demanded_torque(const RigidBodyState& state,
                                                 const AttitudeDemand& demand,
                                                 double dt,
                                                 ControllerMemory& memory) const = 0;

  /// Torque (N m, body) that turns the thrust's axis to `b3_world` while the body spins about it,
  /// as one that has lost a rotor does.
  [[nodiscard]] Vector3d spinning_torque(const RigidBodyState& state,
                                         double rotor_momentum,
                                         const Vector3d& b3_world) const;

  [[nodiscard]] const VehicleSettings& settings() const { return settings_; }
  [[nodiscard]] const LoopGains& gains() const { return gains_; }

  /// Natural frequency (rad/s) of the attitude loop about each body axis, and its damping.
  [[nodiscard]] Vector3d attitude_frequency() const;
  [[nodiscard]] Vector3d attitude_damping() const;

 private:
  /// Attitude, rates and thrust for an acceleration (world, without gravity).
  [[nodiscard]] AttitudeDemand demanded_attitude(const RigidBodyState& state,
                                                 const Vector3d& a_world,
                                                 const Vector3d& jerk_world,
                                                 double yaw,
                                                 double yaw_rate) const;
  /// Force per mass with its tilt cut to the limit: the vertical part is kept.
  [[nodiscard]] Vector3d tilt_limited(const Vector3d& specific_force_world) const;
  [[nodiscard]] double momentum_of(const std::vector<double>& speeds,
                                   const std::vector<double>& shares) const;
  [[nodiscard]] Vector3d ahead(const Vector3d& torque, double rate) const;
  [[nodiscard]] Vector3d position_loop(const RigidBodyState& state,
                                       const PositionCommand& command,
                                       ControllerMemory& memory) const;
  /// Learns the disturbance from what the velocity has done since the last period.
  void observe(const RigidBodyState& state, double dt, ControllerMemory& memory) const;
  [[nodiscard]] Vector3d expected_acceleration(const RigidBodyState& state,
                                               const Vector3d& a_world,
                                               const std::vector<double>& speeds,
                                               const ControllerMemory& memory) const;
  /// True if some turn slower than they are told, and that is allowed for.
  [[nodiscard]] bool rotors_fail(const ControllerMemory& memory) const;
  /// That comes of commanded speeds, N.
  [[nodiscard]] double thrust_of(const std::vector<double>& commands,
                                 const RigidBodyState& state,
                                 const ControllerMemory& memory) const;
  [[nodiscard]] Vector3d drag_of(const RigidBodyState& state, const Vector3d& v_world) const;
  [[nodiscard]] Vector3d velocity_loop(const RigidBodyState& state,
                                       const Vector3d& v_world,
                                       double dt,
                                       ControllerMemory& memory) const;
  [[nodiscard]] static AirMotion motion_of(const RigidBodyState& state);
  /// Rotor speeds for thrust and torque.
  [[nodiscard]] std::vector<double> speeds(const RigidBodyState& state,
                                           double thrust,
                                           const Vector3d& torque,
                                           double dt,
                                           ControllerMemory& memory) const;
  /// A demand cut to the limits of the vehicle.
  [[nodiscard]] Vector3d allowed(const Vector3d& a_world, ControllerMemory& memory) const;
  [[nodiscard]] Vector3d rate_torque(const RigidBodyState& state, const Vector3d& omega) const;

  VehicleSettings settings_;
  LoopGains gains_;
  Mixer mixer_;
};

/// The velocity loop is faster than the position loop by this.
inline constexpr double kVelocityToPosition = 1.5;

/// Natural frequency of the velocity loop along each axis, rad/s.
Vector3d velocity_frequency(const ControllerSettings& settings);

/// Attitude whose z axis is `b3` and whose x axis points to heading `yaw`; if b3 lies along the
/// heading, the nearest that `R_now` allows.
Matrix3d attitude_from(const Vector3d& b3, double yaw, const Matrix3d& R_now);

}  // namespace pointflight
