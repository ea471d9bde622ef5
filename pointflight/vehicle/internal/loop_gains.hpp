#pragma once

#include "pointflight/vehicle/airframe.hpp"

namespace pointflight {

/// What control loops take from a vehicle's settings, worked out once.
struct LoopGains {
  explicit LoopGains(const VehicleSettings& settings);

  Vector3d velocity_square = Vector3d::Zero();   ///< wn^2 of the velocity loop, world.
  Vector3d velocity_damping = Vector3d::Zero();  ///< z wn of it.
  Vector3d attitude_square = Vector3d::Zero();   ///< wn^2 of the attitude loop, body.
  Vector3d attitude_damping = Vector3d::Zero();  ///< z wn of it.
  bool tilt_is_free = false;                     ///< No limit.
  double tilt_tangent = 0.0;                     ///< Of the greatest tilt, otherwise.
  double yaw_lag = 0.0;                          ///< s, at hover speed.
};

}  // namespace pointflight
