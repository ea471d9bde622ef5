#include "pointflight/vehicle/imu.hpp"

#include <cmath>

#include "pointflight/core/random.hpp"
#include "pointflight/geometry/rotation.hpp"

namespace pointflight {

Imu::Imu(const ImuSettings& settings, std::uint64_t seed, std::uint32_t vehicle)
    : settings_(settings),
      seed_(seed),
      vehicle_(vehicle),
      q_body_imu_(quaternion_from_rpy(settings.rotation_rpy_deg.x() * kDegree,
                                      settings.rotation_rpy_deg.y() * kDegree,
                                      settings.rotation_rpy_deg.z() * kDegree)) {}

ImuSample Imu::sample(std::int64_t index,
                      SimTime time,
                      const RigidBodyState& state,
                      const BodyAcceleration& acceleration,
                      Biases& biases) const {
  const double dt = 1.0 / settings_.rate;
  const auto normals = [&](StreamId stream) {
    const RandomStream random(seed_, stream, vehicle_);
    const auto base = static_cast<std::uint64_t>(index) * 3;
    return Vector3d(random.normal(base), random.normal(base + 1), random.normal(base + 2));
  };
  // the first sample has no bias: walks start at zero
  if (index > 0) {
    biases.gyro += settings_.gyro_bias_walk * std::sqrt(dt) * normals(StreamId::kImuGyroBias);
    biases.accel += settings_.accel_bias_walk * std::sqrt(dt) * normals(StreamId::kImuAccelBias);
  }
  // lever arm: a point off the centre of mass also feels the body turn
  const Vector3d& w = state.omega_body;
  const Vector3d& arm = settings_.position;
  const Vector3d force = specific_force_body(state.q_world_body, acceleration.a_world) +
                         acceleration.alpha_body.cross(arm) + w.cross(w.cross(arm));
  const Quaterniond q_imu_body = q_body_imu_.conjugate();
  ImuSample sample;
  sample.vehicle = vehicle_;
  sample.time = time;
  sample.q_world_imu = state.q_world_body * q_body_imu_;
  sample.gyro = q_imu_body * w + biases.gyro +
                settings_.gyro_noise_density / std::sqrt(dt) * normals(StreamId::kImuGyroNoise);
  sample.accel = q_imu_body * force + biases.accel +
                 settings_.accel_noise_density / std::sqrt(dt) * normals(StreamId::kImuAccelNoise);
  return sample;
}

}  // namespace pointflight
