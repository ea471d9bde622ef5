#pragma once

#include <vector>

#include "pointflight/geometry/types.hpp"

namespace pointflight {

/// Where a vehicle is and how it moves. World: ENU, z up. Body: x forward, y left, z up, origin at
/// the centre of mass.
struct RigidBodyState {
  Vector3d p_world = Vector3d::Zero();                 ///< Of the centre of mass, m.
  Vector3d v_world = Vector3d::Zero();                 ///< m/s
  Quaterniond q_world_body = Quaterniond::Identity();  ///< Unit; body axes in the world.
  Vector3d omega_body = Vector3d::Zero();              ///< rad/s

  /// Takes points of the body to the world.
  [[nodiscard]] Pose T_world_body() const { return {q_world_body, p_world}; }
  /// False if any figure is NaN or infinite: the dynamics diverged, or a source sent nonsense.
  [[nodiscard]] bool is_finite() const {
    return p_world.allFinite() && v_world.allFinite() && q_world_body.coeffs().allFinite() &&
           omega_body.allFinite();
  }
};

/// A rotor's speed and its rate of change.
struct RotorState {
  double speed = 0.0;         ///< rad/s, never negative
  double acceleration = 0.0;  ///< rad/s^2
};

/// A vehicle's body and rotors: all that its dynamics advance.
struct VehicleState {
  RigidBodyState body;             ///< Pose and velocities.
  std::vector<RotorState> rotors;  ///< In the order of the vehicle file.
};

/// Accelerations that belong to a state: what an IMU feels.
struct BodyAcceleration {
  Vector3d a_world = Vector3d::Zero();     ///< Of the centre of mass.
  Vector3d alpha_body = Vector3d::Zero();  ///< rad/s^2
};

}  // namespace pointflight
