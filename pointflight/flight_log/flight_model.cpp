#include "pointflight/flight_log/internal/flight_model.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "pointflight/core/math.hpp"
#include "pointflight/vehicle/imu.hpp"
#include "pointflight/vehicle/motor_outputs.hpp"
#include "pointflight/vehicle/multirotor.hpp"

namespace pointflight::flight_log {
namespace {

constexpr double kFarthest = 3.0;  // of a logarithm: 20 times
constexpr std::size_t kBlocksInCluster = 2;

double scale_of(double logarithm) {
  return math::exp(std::clamp(logarithm, -kFarthest, kFarthest));
}

/// What moves on from sample to sample.
struct Running {
  VehicleState state;
  Vector3d turned = Vector3d::Zero();  ///< Rates since the stretch began, by torque alone, rad/s.
};

/// Advances the rotors by `dt`, the body as it was logged; returns by how much torque turns it
/// meanwhile, rad/s (Simpson's rule: rotors take their speeds within a few milliseconds).
Vector3d turn_over(const Multirotor& multirotor,
                   const std::vector<double>& speeds,
                   const FlightConditions& air,
                   const RigidBodyState& body,
                   double dt,
                   VehicleState& state) {
  const auto alpha = [&] {
    state.body = body;
    return multirotor.acceleration(state, air).alpha_body;
  };
  const Vector3d first = alpha();
  multirotor.step(state, speeds, 0.5 * dt, air);
  const Vector3d middle = alpha();
  multirotor.step(state, speeds, 0.5 * dt, air);
  return dt / 6.0 * (first + 4.0 * middle + alpha());
}

}  // namespace

Unknowns unknowns_of(const VehicleSettings& vehicle) {
  Unknowns values = Unknowns::Zero();
  values[kIdle] = vehicle.rotor.speed_min / vehicle.rotor.speed_max;
  values[kRotorDrag] = vehicle.rotor.drag_coefficient * vehicle.rotor.speed_max / vehicle.mass;
  values[kDragAcross] = 0.5 * (vehicle.drag_area.x() + vehicle.drag_area.y()) / vehicle.mass;
  values[kDragAlong] = vehicle.drag_area.z() / vehicle.mass;
  return values;
}

VehicleSettings vehicle_with(const VehicleSettings& like, const Unknowns& values) {
  VehicleSettings vehicle = like;
  const double thrust = scale_of(values[kThrust]);
  vehicle.rotor.thrust_coefficient *= thrust;
  vehicle.rotor.torque_coefficient *= thrust;
  vehicle.rotor.speed_min = std::clamp(values[kIdle], 0.0, 0.9) * like.rotor.speed_max;
  vehicle.rotor.natural_frequency *= scale_of(-values[kLag]);
  vehicle.rotor.drag_coefficient =
      std::max(0.0, values[kRotorDrag]) * like.mass / like.rotor.speed_max;
  // x and y keep their ratio
  const double across = std::max(0.0, values[kDragAcross]) * like.mass;
  const double across_before = 0.5 * (like.drag_area.x() + like.drag_area.y());
  const Vector3d shape =
      across_before > 0.0 ? Vector3d(like.drag_area / across_before) : Vector3d(Vector3d::Ones());
  vehicle.drag_area = {
      across * shape.x(), across * shape.y(), std::max(0.0, values[kDragAlong]) * like.mass};
  vehicle.inertia_diagonal.x() *= scale_of(values[kInertiaX]);
  vehicle.inertia_diagonal.y() *= scale_of(values[kInertiaY]);
  vehicle.inertia_diagonal.z() *= scale_of(values[kInertiaZ]);
  return vehicle;
}

FlightModel::FlightModel(const VehicleSettings& like, std::vector<FlownSample> samples)
    : like_(like), samples_(std::move(samples)) {
  double block_began = 0.0;
  for (std::size_t i = 0; i < samples_.size(); ++i) {
    const FlownSample& sample = samples_[i];
    if (sample.is_settling) continue;
    const bool is_new = rows_.empty() || sample.stretch != samples_[rows_.back().sample].stretch ||
                        sample.time - block_began > kBlock;
    if (is_new) {
      ++blocks_;
      block_began = sample.time;
    } else {
      duration_ += sample.time - samples_[rows_.back().sample].time;
    }
    rows_.push_back({i, blocks_ - 1});
  }
  const std::size_t every = rows_.size() / kMostRows + 1;
  for (std::size_t row = 0; row < rows_.size(); row += every) {
    kept_.push_back(row);
    clusters_.push_back(rows_[row].block / kBlocksInCluster);
  }
}

double FlightModel::velocity_vagueness() const {
  constexpr double kVelocityError = 0.1;  // m/s, of an estimator; assumed
  Vector3d mean = Vector3d::Zero();
  for (const Row& row : rows_) mean += samples_[row.sample].state.v_world;
  mean /= static_cast<double>(rows_.size());
  double variance = 0.0;
  for (const Row& row : rows_) {
    variance += (samples_[row.sample].state.v_world - mean).squaredNorm() / 3.0;
  }
  variance /= static_cast<double>(rows_.size());
  const double error = kVelocityError * kVelocityError;
  return variance > error ? error / (variance - error) : std::numeric_limits<double>::infinity();
}

Eigen::MatrixXd FlightModel::residuals(const Unknowns& values) const {
  const VehicleSettings vehicle = vehicle_with(like_, values);
  const Multirotor multirotor(vehicle);
  const MotorOutputs motors(vehicle);
  FlightConditions air;
  air.wind_world = {values[kWindX], values[kWindY], 0.0};
  const Vector3d bias = values.segment<3>(kBiasX);
  const Vector3d torque = values.segment<3>(kTorqueX);
  Running now;
  now.state.rotors.resize(vehicle.rotors.size());
  std::vector<Vector3d> turned(samples_.size());
  std::vector<Vector3d> force(samples_.size());
  for (std::size_t i = 0; i < samples_.size(); ++i) {
    const FlownSample& sample = samples_[i];
    if (i == 0 || sample.stretch != samples_[i - 1].stretch) {
      const auto speeds = motors.speeds(sample.since.back().given->outputs, true);
      for (std::size_t r = 0; r < speeds.size(); ++r) now.state.rotors[r] = {speeds[r], 0.0};
      now.turned.setZero();
    } else {
      for (std::size_t k = 0; k < sample.since.size(); ++k) {
        const double until = k + 1 < sample.since.size() ? sample.since[k + 1].from : sample.time;
        const double dt = until - sample.since[k].from;
        const auto speeds = motors.speeds(sample.since[k].given->outputs, true);
        now.turned += dt * torque;
        if (dt > 0.0) {
          now.turned += turn_over(multirotor, speeds, air, sample.state, dt, now.state);
        }
      }
    }
    now.state.body = sample.state;
    const BodyAcceleration acceleration = multirotor.acceleration(now.state, air);
    const Vector3d& omega = sample.state.omega_body;
    const Vector3d& arm = vehicle.imu.position;
    force[i] = specific_force_body(sample.state.q_world_body, acceleration.a_world) + bias +
               (acceleration.alpha_body + torque).cross(arm) + omega.cross(omega.cross(arm));
    turned[i] = sample.state.omega_body - now.turned;
  }
  std::vector<Vector3d> mean(blocks_, Vector3d::Zero());
  std::vector<double> count(blocks_, 0.0);
  for (const Row& row : rows_) {
    mean[row.block] += turned[row.sample];
    count[row.block] += 1.0;
  }
  for (std::size_t b = 0; b < blocks_; ++b) mean[b] /= count[b];
  Eigen::MatrixXd residuals(kept_.size(), 6);
  for (std::size_t k = 0; k < kept_.size(); ++k) {
    const Row& row = rows_[kept_[k]];
    const auto at = static_cast<Eigen::Index>(k);
    residuals.block<1, 3>(at, 0) = (samples_[row.sample].accel - force[row.sample]).transpose();
    residuals.block<1, 3>(at, 3) = (turned[row.sample] - mean[row.block]).transpose();
  }
  return residuals;
}

}  // namespace pointflight::flight_log
