#include "pointflight/vehicle/imu.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "pointflight/core/floor.hpp"
#include "pointflight/core/math.hpp"
#include "pointflight/core/random.hpp"
#include "pointflight/geometry/rotation.hpp"

namespace pointflight {
namespace {

constexpr double kShortestFlicker = 1.0 / 16.0;  // s
constexpr double kFlickerStep = 4.0;             // from one time constant to the next

/// What of a run's IMU is drawn once.
enum class Once : std::uint64_t {
  kGyroTurnOn,
  kAccelTurnOn,
  kGyroScale,
  kAccelScale,
  kGyroLean,  // two draws each: an axis leans to the two others
  kGyroLean2,
  kAccelLean,
  kAccelLean2,
  kForce,  // a row of the matrix each
  kForce2,
  kForce3,
};

/// True for what errs by noise and walk alone.
bool is_plain(const ImuErrors& e) {
  const auto triad = [](const TriadErrors& t) {
    return t.bias_instability == 0.0 && t.turn_on_bias == 0.0 && t.scale_error == 0.0 &&
           t.misalignment_deg == 0.0 && t.range == 0.0;
  };
  return triad(e.gyro) && triad(e.accel) && e.gyro_g_sensitivity == 0.0 && !e.clock_errs();
}

/// 1 plus scale errors on the diagonal; beside it how the row's axis leans to the others.
Matrix3d scale_of(const TriadErrors& e,
                  const Vector3d& scale,
                  const Vector3d& lean,
                  const Vector3d& lean2) {
  const double angle = e.misalignment_deg * kDegree;
  Matrix3d m = Matrix3d::Identity();
  for (int i = 0; i < 3; ++i) {
    m(i, i) += e.scale_error * scale[i];
    m(i, (i + 1) % 3) = angle * lean[i];
    m(i, (i + 2) % 3) = angle * lean2[i];
  }
  return m;
}

/// What a converter gives out; all of its range has 2^bits values.
Vector3d read_out(const Vector3d& value, double range, std::int64_t bits) {
  if (range <= 0.0) return value;
  Vector3d out = value.cwiseMax(-range).cwiseMin(range);
  if (bits <= 0) return out;
  const double step = 2.0 * range / static_cast<double>(std::int64_t{1} << bits);
  for (int i = 0; i < 3; ++i) {
    out[i] =
        std::min(range - step, step * static_cast<double>(floor_to_integer(out[i] / step + 0.5)));
  }
  return out;
}

}  // namespace

void AxisNormals::draw(const RandomStream& stream, std::uint64_t first) {
  std::array<double, 3 * kAhead> unused{};
  stream.normal2(3 * first, draws_, unused);
  first_ = first;
}

FlickerNoise::FlickerNoise(double instability, double dt)
    : deviation_(std::sqrt(2.0 * math::log(2.0) / kPi) * instability) {
  double constant = kShortestFlicker;
  for (std::size_t k = 0; k < kProcesses; ++k) {
    decay_[k] = math::exp(-dt / constant);
    kick_[k] = deviation_ * std::sqrt(1.0 - decay_[k] * decay_[k]);
    constant *= kFlickerStep;
  }
}

Imu::Imu(const VehicleSettings& vehicle, std::uint64_t seed, std::uint32_t number)
    : settings_(vehicle.imu),
      errors_(vehicle.imu.in_use()),
      vibration_(vehicle.vibration),
      hover_speed_(vehicle.rotors.empty() ? 0.0 : vehicle.hover_speed()),
      is_plain_(is_plain(errors_)),
      seed_(seed),
      vehicle_(number),
      q_imu_body_(quaternion_from_rpy(settings_.rotation_rpy_deg.x() * kDegree,
                                      settings_.rotation_rpy_deg.y() * kDegree,
                                      settings_.rotation_rpy_deg.z() * kDegree)
                      .conjugate()),
      gyro_flicker_(errors_.gyro.bias_instability, 1.0 / settings_.rate),
      accel_flicker_(errors_.accel.bias_instability, 1.0 / settings_.rate) {
  AxisNormals draws;
  const auto once = [&](Once what) {
    return normals(StreamId::kImuTurnOn, static_cast<std::uint64_t>(what), draws);
  };
  gyro_turn_on_ = errors_.gyro.turn_on_bias * once(Once::kGyroTurnOn);
  accel_turn_on_ = errors_.accel.turn_on_bias * once(Once::kAccelTurnOn);
  gyro_scale_ =
      scale_of(errors_.gyro, once(Once::kGyroScale), once(Once::kGyroLean), once(Once::kGyroLean2));
  accel_scale_ = scale_of(
      errors_.accel, once(Once::kAccelScale), once(Once::kAccelLean), once(Once::kAccelLean2));
  g_sensitivity_ << once(Once::kForce), once(Once::kForce2), once(Once::kForce3);
  g_sensitivity_ *= errors_.gyro_g_sensitivity;
}

/// Three draws, number `which`.
Vector3d Imu::normals(StreamId stream, std::uint64_t which, AxisNormals& draws) const {
  return Vector3d::Map(draws.of(RandomStream(seed_, stream, vehicle_), which));
}

/// Rotors out of balance shake the body across their axes, once per turn; blades along them, once
/// per blade that passes an arm. Forces of imbalance grow with the square of the speed. All rotors
/// start at angles of their own.
void Imu::vibrate(bool is_first,
                  const VehicleState& state,
                  Memory& memory,
                  Vector3d& gyro,
                  Vector3d& accel) const {
  if (vibration_.is_off() || state.rotors.empty()) return;
  const RandomStream random(seed_, StreamId::kVibration, vehicle_);
  if (memory.rotor_angles.size() != state.rotors.size()) {
    memory.rotor_angles.clear();
    for (std::size_t i = 0; i < state.rotors.size(); ++i) {
      memory.rotor_angles.push_back(2.0 * kPi * random.uniform(i));
    }
  }
  const auto blades = static_cast<double>(vibration_.blades);
  for (std::size_t i = 0; i < state.rotors.size(); ++i) {
    double& angle = memory.rotor_angles[i];
    const double speed = state.rotors[i].speed;
    if (!is_first) angle = std::remainder(angle + speed / settings_.rate, 2.0 * kPi);
    const double share = speed * speed / (hover_speed_ * hover_speed_);
    const auto turn = math::sincos(angle);
    const auto blade = math::sincos(blades * angle);
    accel += share * Vector3d(vibration_.rotor_accel * turn.cos,
                              vibration_.rotor_accel * turn.sin,
                              vibration_.blade_accel * blade.cos);
    gyro += share * vibration_.rotor_gyro * Vector3d(turn.cos, turn.sin, 0.0);
  }
}

ImuSample Imu::sample(std::int64_t index,
                      SimTime time,
                      const VehicleState& state,
                      const BodyAcceleration& acceleration,
                      Memory& memory) const {
  const double dt = 1.0 / settings_.rate;
  const auto number = static_cast<std::uint64_t>(index);
  const bool is_first = !std::exchange(memory.has_begun, true);
  // the first sample has no walk: it starts at zero
  if (!is_first) {
    memory.gyro_walk += errors_.gyro.bias_walk * std::sqrt(dt) *
                        normals(StreamId::kImuGyroBias, number, memory.gyro_walk_draws);
    memory.accel_walk += errors_.accel.bias_walk * std::sqrt(dt) *
                         normals(StreamId::kImuAccelBias, number, memory.accel_walk_draws);
  }
  // lever arm: a point off the centre of mass also feels the body turn
  const RigidBodyState& body = state.body;
  const Vector3d& w = body.omega_body;
  const Vector3d& arm = settings_.position;
  Vector3d force = specific_force_body(body.q_world_body, acceleration.a_world) +
                   acceleration.alpha_body.cross(arm) + w.cross(w.cross(arm));
  Vector3d rates = w;
  vibrate(is_first, state, memory, rates, force);

  ImuSample sample;
  sample.vehicle = vehicle_;
  sample.time = time;
  sample.stamp = time;
  sample.q_world_imu = body.q_world_body * q_imu_body_.conjugate();
  sample.gyro = q_imu_body_ * rates + memory.gyro_walk +
                errors_.gyro.noise_density / std::sqrt(dt) *
                    normals(StreamId::kImuGyroNoise, number, memory.gyro_draws);
  sample.accel = q_imu_body_ * force + memory.accel_walk +
                 errors_.accel.noise_density / std::sqrt(dt) *
                     normals(StreamId::kImuAccelNoise, number, memory.accel_draws);
  if (!is_plain_)
    add_steady_errors(number, is_first, q_imu_body_ * rates, q_imu_body_ * force, memory, sample);
  return sample;
}

/// Scales, leaning axes, turn-on biases, flicker, sensitivity to force; then the converter and the
/// clock.
void Imu::add_steady_errors(std::uint64_t number,
                            bool is_first,
                            const Vector3d& rates,
                            const Vector3d& force,
                            Memory& memory,
                            ImuSample& sample) const {
  const Matrix3d one = Matrix3d::Identity();
  sample.gyro += (gyro_scale_ - one) * rates + gyro_turn_on_ + g_sensitivity_ * force;
  sample.accel += (accel_scale_ - one) * force + accel_turn_on_;
  constexpr std::size_t kDraws = 3 * FlickerNoise::kProcesses;
  std::array<double, kDraws> draws{};
  std::array<double, kDraws> unused{};
  const auto flicker = [&](StreamId stream) {
    RandomStream(seed_, stream, vehicle_).normal2(number * kDraws, draws, unused);
    return [&draws](std::size_t k) {
      return Vector3d(draws[3 * k], draws[3 * k + 1], draws[3 * k + 2]);
    };
  };
  if (gyro_flicker_.deviation() > 0.0) {
    sample.gyro +=
        gyro_flicker_.step(is_first, memory.gyro_flicker, flicker(StreamId::kImuGyroFlicker));
  }
  if (accel_flicker_.deviation() > 0.0) {
    sample.accel +=
        accel_flicker_.step(is_first, memory.accel_flicker, flicker(StreamId::kImuAccelFlicker));
  }
  const std::int64_t accel_bits = errors_.accel_bits > 0 ? errors_.accel_bits : errors_.bits;
  sample.gyro = read_out(sample.gyro, errors_.gyro.range, errors_.bits);
  sample.accel = read_out(sample.accel, errors_.accel.range, accel_bits);
  if (errors_.clock_errs()) {
    const RandomStream random(seed_, StreamId::kImuClock, vehicle_);
    sample.stamp +=
        from_seconds(errors_.clock_offset + errors_.clock_jitter * random.normal(number));
  }
}

}  // namespace pointflight
