#pragma once

#include <cstdint>

#include "pointflight/core/constants.hpp"
#include "pointflight/core/time.hpp"
#include "pointflight/vehicle/airframe.hpp"
#include "pointflight/vehicle/state.hpp"

namespace pointflight {

/// One sample of an IMU.
struct ImuSample {
  std::uint32_t vehicle = 0;  ///< Number in the fleet, from 0.
  SimTime time;               ///< When it was measured; nothing delays it.
  Vector3d gyro;              ///< rad/s, IMU axes.
  Vector3d accel;  ///< Specific force, m/s^2, IMU axes: +9.81 on z when level and at rest.
  Quaterniond q_world_imu = Quaterniond::Identity();  ///< Truth: the attitude of its axes.
};

/// What an ideal accelerometer at the body origin reads: acceleration minus gravity (REP 145).
inline Vector3d specific_force_body(const Quaterniond& q_world_body, const Vector3d& a_world) {
  return q_world_body.conjugate() * (a_world + Vector3d(0, 0, kGravity));
}

/// Gyroscope and accelerometer with lever arm, white noise and bias random walks.
///
/// Discrete noise: density / sqrt(dt); bias steps: walk * sqrt(dt) (docs/conventions.md). Draws are
/// addressed by sample number, so that a sample does not depend on what else was simulated; the
/// biases are the only state, which the caller keeps.
class Imu {
 public:
  /// `seed` and the `vehicle`'s number address its random draws.
  Imu(const ImuSettings& settings, std::uint64_t seed, std::uint32_t vehicle);

  /// What walks from sample to sample.
  struct Biases {
    Vector3d gyro = Vector3d::Zero();   ///< rad/s
    Vector3d accel = Vector3d::Zero();  ///< m/s^2
  };

  /// Sample number `index` (0, 1, ...; ask for each once and in order).
  ImuSample sample(std::int64_t index,
                   SimTime time,
                   const RigidBodyState& state,
                   const BodyAcceleration& acceleration,
                   Biases& biases) const;

 private:
  ImuSettings settings_;
  std::uint64_t seed_;
  std::uint32_t vehicle_;
  Quaterniond q_body_imu_;
};

}  // namespace pointflight
