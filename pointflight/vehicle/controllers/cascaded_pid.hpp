#pragma once

#include "pointflight/vehicle/controller.hpp"
#include "pointflight/vehicle/mixer.hpp"

namespace pointflight {

/// Cascaded PID (the paper, section IV.C): an outer position loop and an inner attitude loop, each
/// of second order with a chosen natural frequency wn and damping z, plus an integral:
///
///   a = a_ff + wn^2 e_p + 2 z wn e_v + ki integral(e_p),        thrust = m (a + g) along body z
///   torque = J (wn^2 e_R + 2 z wn e_w + ki integral(e_R)) + w x J w
///
/// e_R is the rotation vector from the present to the demanded attitude (on SO(3), in the body);
/// demanded rates come from the jerk, as in Mellinger and Kumar 2011, eqs. 7 and 8.
class CascadedPid : public Controller {
 public:
  explicit CascadedPid(const VehicleSettings& settings);

  std::vector<double> update(const RigidBodyState& state,
                             const PositionCommand& command,
                             double dt) override;
  void reset() override;

 private:
  struct AttitudeDemand {
    Quaterniond q_world_body;
    Vector3d omega_body;
    double thrust = 0.0;
  };
  [[nodiscard]] Vector3d demanded_acceleration(const RigidBodyState& state,
                                               const PositionCommand& command,
                                               double dt);
  [[nodiscard]] AttitudeDemand demanded_attitude(const RigidBodyState& state,
                                                 const PositionCommand& command,
                                                 const Vector3d& a_world) const;
  [[nodiscard]] Vector3d demanded_torque(const RigidBodyState& state,
                                         const AttitudeDemand& demand,
                                         double dt);

  VehicleSettings settings_;
  Mixer mixer_;
  Vector3d position_integral_ = Vector3d::Zero();  ///< In m/s^2: gain included.
  Vector3d attitude_integral_ = Vector3d::Zero();  ///< In rad/s^2: gain included.
};

}  // namespace pointflight
