#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "pointflight/core/constants.hpp"
#include "pointflight/core/random.hpp"
#include "pointflight/core/time.hpp"
#include "pointflight/vehicle/airframe.hpp"
#include "pointflight/vehicle/state.hpp"

namespace pointflight {

/// One sample of an IMU.
struct ImuSample {
  std::uint32_t vehicle = 0;  ///< Number in the fleet, from 0.
  SimTime time;               ///< When it was measured; nothing delays it.
  SimTime stamp;              ///< What its own clock says that was.
  Vector3d gyro;              ///< rad/s, IMU axes.
  Vector3d accel;  ///< Specific force, m/s^2, IMU axes: +9.81 on z when level and at rest.
  Quaterniond q_world_imu = Quaterniond::Identity();  ///< Truth: the attitude of its axes.
};

/// What an ideal accelerometer at the body origin reads: acceleration minus gravity (REP 145).
inline Vector3d specific_force_body(const Quaterniond& q_world_body, const Vector3d& a_world) {
  return q_world_body.conjugate() * (a_world + Vector3d(0, 0, kGravity));
}

/// Flicker noise of three axes: a sum of first-order Gauss-Markov processes, one for each fourfold
/// time constant T from 1/16 to 16,384 s, all of the same steady deviation s. The sum of their
/// spectra is s^2 / (ln 4 f) between; its Allan deviation is flat and equals s.
class FlickerNoise {
 public:
  static constexpr std::size_t kProcesses = 10;     ///< Their number.
  using Values = std::array<Vector3d, kProcesses>;  ///< What they are at a sample.

  /// `instability` B as of `TriadErrors`; `dt`: between samples, s.
  FlickerNoise(double instability, double dt);
  /// Their steady deviation s = sqrt(2 ln 2 / pi) B; 0: there is none.
  [[nodiscard]] double deviation() const { return deviation_; }
  /// Advances to the next sample, to the first from anything; `normals(k)`: three standard normals
  /// for process k. Returns the sum.
  template <class Normals>
  Vector3d step(bool is_first, Values& values, const Normals& normals) const {
    Vector3d sum = Vector3d::Zero();
    for (std::size_t k = 0; k < kProcesses; ++k) {
      values[k] = is_first ? Vector3d(deviation_ * normals(k))
                           : Vector3d(decay_[k] * values[k] + kick_[k] * normals(k));
      sum += values[k];
    }
    return sum;
  }

 private:
  double deviation_;
  std::array<double, kProcesses> decay_{}, kick_{};
};

/// Standard normals for three axes, `RandomStream::normal` of index sample * 3 + axis, drawn for
/// several samples at once: the same bits, in a fraction of the time.
class AxisNormals {
 public:
  /// Of a sample. Always ask with the same stream.
  const double* of(const RandomStream& stream, std::uint64_t sample) {
    const std::uint64_t first = sample - sample % kAhead;
    if (first != first_) draw(stream, first);
    return &draws_[3 * (sample - first)];
  }

 private:
  static constexpr std::uint64_t kAhead = 16;
  void draw(const RandomStream& stream, std::uint64_t first);

  std::uint64_t first_ = ~std::uint64_t{0};  ///< Sample that the draws begin with.
  std::array<double, 3 * kAhead> draws_{};
};

/// Gyroscope and accelerometer with lever arm and the errors of their file.
///
/// Discrete white noise: density / sqrt(dt); bias steps: walk * sqrt(dt) (docs/conventions.md).
/// A triad reads S m + turn-on bias + flicker + walk + white noise, S of scales and misalignments,
/// the gyro with a bias in proportion to the force, saturated and rounded last. Draws are addressed
/// by sample number, so that a sample does not depend on what else was simulated; `Memory` is the
/// only state, which the caller keeps.
class Imu {
 public:
  /// `seed` and the vehicle's `number` address its random draws.
  Imu(const VehicleSettings& vehicle, std::uint64_t seed, std::uint32_t number);

  /// What goes on from sample to sample.
  struct Memory {
    Vector3d gyro_walk = Vector3d::Zero();   ///< rad/s
    Vector3d accel_walk = Vector3d::Zero();  ///< m/s^2
    FlickerNoise::Values gyro_flicker{};     ///< rad/s
    FlickerNoise::Values accel_flicker{};    ///< m/s^2
    std::vector<double> rotor_angles;        ///< rad; empty without vibration.
    bool has_begun = false;                  ///< A sample was taken.
    AxisNormals gyro_walk_draws;             ///< Drawn again if they are missing, as all below.
    AxisNormals accel_walk_draws;            ///< Of the accelerometer's bias.
    AxisNormals gyro_draws;                  ///< Of white noise.
    AxisNormals accel_draws;                 ///< The same of the accelerometer.
  };

  /// Sample number `index` (ask for each once and in order; a run may begin late, and skip some).
  ImuSample sample(std::int64_t index,
                   SimTime time,
                   const VehicleState& state,
                   const BodyAcceleration& acceleration,
                   Memory& memory) const;

 private:
  [[nodiscard]] Vector3d normals(StreamId stream, std::uint64_t which, AxisNormals& draws) const;
  void add_steady_errors(std::uint64_t number,
                         bool is_first,
                         const Vector3d& rates,
                         const Vector3d& force,
                         Memory& memory,
                         ImuSample& sample) const;
  void vibrate(bool is_first,
               const VehicleState& state,
               Memory& memory,
               Vector3d& gyro,
               Vector3d& accel) const;

  ImuSettings settings_;
  ImuErrors errors_;
  VibrationSettings vibration_;
  double hover_speed_;
  bool is_plain_;  ///< Nothing but noise and walk.
  std::uint64_t seed_;
  std::uint32_t vehicle_;
  Quaterniond q_imu_body_;
  FlickerNoise gyro_flicker_;
  FlickerNoise accel_flicker_;
  // of this run
  Matrix3d gyro_scale_ = Matrix3d::Identity();
  Matrix3d accel_scale_ = Matrix3d::Identity();
  Matrix3d g_sensitivity_ = Matrix3d::Zero();
  Vector3d gyro_turn_on_ = Vector3d::Zero();
  Vector3d accel_turn_on_ = Vector3d::Zero();
};

}  // namespace pointflight
