#include "pointflight/vehicle/mixer.hpp"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <cassert>
#include <cmath>

#include "pointflight/core/constants.hpp"
#include "pointflight/core/input_error.hpp"
#include "pointflight/vehicle/bounded_least_squares.hpp"

namespace pointflight {
namespace {

/// The largest share in [0, 1] of `part` that can be added to `base` without leaving [min, max].
double feasible_share(const Eigen::VectorXd& base,
                      const Eigen::VectorXd& part,
                      double min,
                      double max) {
  double share = 1.0;
  for (Eigen::Index i = 0; i < base.size(); ++i) {
    if (base[i] + part[i] > max && part[i] > 0.0)
      share = std::min(share, (max - base[i]) / part[i]);
    if (base[i] + part[i] < min && part[i] < 0.0)
      share = std::min(share, (min - base[i]) / part[i]);
  }
  return std::max(0.0, share);
}

// What gives way to what, if not all can be had: squared, these weigh shares of the weight, and
// of the torques that it makes at the arms and by the rotors' drag.
constexpr double kThrustWeight = 30.0;
constexpr double kTiltWeight = 300.0;
constexpr double kYawWeight = 3.0;
constexpr double kEvenWeight = 0.1;    // of rotors that do alike
constexpr double kLeastShare = 0.05;   // a rotor with less is as good as lost
constexpr double kHeadingShare = 0.2;  // of a rotor's torque in hover, left over when it spins

}  // namespace

Mixer::Mixer(const VehicleSettings& settings)
    : rotor_(settings.rotor),
      places_(settings.rotors),
      thrust_coefficient_(settings.rotor.thrust_coefficient),
      thrust_min_(thrust_coefficient_ * settings.rotor.speed_min * settings.rotor.speed_min),
      thrust_max_(thrust_coefficient_ * settings.rotor.speed_max * settings.rotor.speed_max),
      weight_(settings.mass * kGravity) {
  const auto n = static_cast<Eigen::Index>(settings.rotors.size());
  allocation_.resize(4, n);
  const double torque_per_thrust = settings.rotor.torque_coefficient / thrust_coefficient_;
  for (Eigen::Index i = 0; i < n; ++i) {
    const RotorPlacement& rotor = settings.rotors[static_cast<std::size_t>(i)];
    // r x T e3 = (y, -x, 0) T
    allocation_.col(i) << 1.0, rotor.position.y(), -rotor.position.x(),
        rotor.yaw_sign * torque_per_thrust;
  }
  const Eigen::Matrix4d square = allocation_ * allocation_.transpose();
  const Eigen::FullPivLU<Eigen::Matrix4d> lu(square);
  if (lu.rank() < 4) {
    throw InputError(
        fmt::format("{}: rotors: this layout cannot make thrust, roll, pitch and yaw by itself",
                    settings.path));
  }
  inverse_ = allocation_.transpose() * lu.inverse();
}

/// Along a rotor's axis, m/s.
double Mixer::climb_of(std::size_t rotor, const AirMotion& motion) const {
  return (motion.v_body + motion.omega_body.cross(places_[rotor].position)).z();
}

std::vector<double> Mixer::speeds(const Wrench& wrench, const AirMotion& motion) const {
  const auto n = static_cast<double>(allocation_.cols());
  Eigen::VectorXd tilt = inverse_.col(1) * wrench.torque.x() + inverse_.col(2) * wrench.torque.y();
  const Eigen::VectorXd yaw = inverse_.col(3) * wrench.torque.z();

  // roll and pitch must fit between the limits at some thrust
  const double spread = tilt.maxCoeff() - tilt.minCoeff();
  if (spread > thrust_max_ - thrust_min_) tilt *= (thrust_max_ - thrust_min_) / spread;
  // thrust gives way to them
  Eigen::VectorXd lift = inverse_.col(0) * wrench.thrust;
  const double mean = lift.sum() / n;
  const double room_low = thrust_min_ - (lift + tilt).minCoeff();
  const double room_high = thrust_max_ - (lift + tilt).maxCoeff();
  const double shift = room_low > 0.0 ? room_low : std::min(0.0, room_high);
  if (shift != 0.0) {
    lift = Eigen::VectorXd::Constant(lift.size(), mean + shift);
    lift = lift.cwiseMax(thrust_min_ - tilt.minCoeff()).cwiseMin(thrust_max_ - tilt.maxCoeff());
  }
  // yaw takes what is left
  const Eigen::VectorXd base = lift + tilt;
  const Eigen::VectorXd thrusts = base + feasible_share(base, yaw, thrust_min_, thrust_max_) * yaw;
  std::vector<double> speeds(static_cast<std::size_t>(thrusts.size()));
  for (std::size_t i = 0; i < speeds.size(); ++i) {
    const double thrust = thrusts[static_cast<Eigen::Index>(i)];
    speeds[i] = rotor_.speed_for(std::clamp(thrust, thrust_min_, thrust_max_), climb_of(i, motion));
    if (!rotor_.advance_ratios.empty()) {
      speeds[i] = std::clamp(speeds[i], rotor_.speed_min, rotor_.speed_max);
    }
  }
  return speeds;
}

Eigen::VectorXd Mixer::thrusts_of_what_is_left(const Wrench& wrench,
                                               std::span<const double> shares) const {
  const Eigen::Index n = allocation_.cols();
  assert(static_cast<Eigen::Index>(shares.size()) == n);
  const double even = weight_ / static_cast<double>(n);  // the unit of unknowns
  // torques in shares of what the weight makes at the farthest arm, or by drag
  const double arm =
      std::max(allocation_.row(1).cwiseAbs().maxCoeff(), allocation_.row(2).cwiseAbs().maxCoeff());
  const double drag = allocation_.row(3).cwiseAbs().maxCoeff();
  const Eigen::Vector4d scale(kThrustWeight / weight_,
                              kTiltWeight / (weight_ * arm),
                              kTiltWeight / (weight_ * arm),
                              kYawWeight / (weight_ * drag));
  Eigen::MatrixXd a(4 + n, n);
  a.topRows(4) = even * scale.asDiagonal() * allocation_;
  a.bottomRows(n) = kEvenWeight * Eigen::MatrixXd::Identity(n, n);
  Eigen::VectorXd b = Eigen::VectorXd::Constant(4 + n, kEvenWeight * wrench.thrust / weight_);
  b.head<4>() = scale.cwiseProduct(
      Eigen::Vector4d(wrench.thrust, wrench.torque.x(), wrench.torque.y(), wrench.torque.z()));
  Eigen::VectorXd low(n);
  Eigen::VectorXd high(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const double share = shares[static_cast<std::size_t>(i)];
    const double square = share < kLeastShare ? 0.0 : share * share;
    low[i] = square * thrust_min_ / even;
    high[i] = square * thrust_max_ / even;
  }
  return even * bounded_least_squares(a, b, low, high);
}

std::vector<double> Mixer::speeds_with_failed_rotors(const Wrench& wrench,
                                                     const AirMotion& motion,
                                                     std::span<const double> shares) const {
  const Eigen::VectorXd thrusts = thrusts_of_what_is_left(wrench, shares);
  std::vector<double> speeds(shares.size());
  for (std::size_t i = 0; i < speeds.size(); ++i) {
    if (shares[i] < kLeastShare) continue;  // told to stop
    const double turning =
        rotor_.speed_for(thrusts[static_cast<Eigen::Index>(i)], climb_of(i, motion));
    speeds[i] = std::clamp(turning / shares[i], rotor_.speed_min, rotor_.speed_max);
  }
  return speeds;
}

bool Mixer::holds_heading(std::span<const double> shares) const {
  const Eigen::VectorXd thrusts = thrusts_of_what_is_left({weight_, Vector3d::Zero()}, shares);
  const double most =
      weight_ / static_cast<double>(allocation_.cols()) * allocation_.row(3).cwiseAbs().maxCoeff();
  return std::abs(allocation_.row(3).dot(thrusts)) < kHeadingShare * most;
}

Wrench Mixer::wrench(const std::vector<double>& speeds, const AirMotion& motion) const {
  assert(static_cast<Eigen::Index>(speeds.size()) == allocation_.cols());
  Eigen::VectorXd thrusts(static_cast<Eigen::Index>(speeds.size()));
  for (std::size_t i = 0; i < speeds.size(); ++i) {
    thrusts[static_cast<Eigen::Index>(i)] = thrust_coefficient_ * speeds[i] * speeds[i] *
                                            rotor_.thrust_share(climb_of(i, motion), speeds[i]);
  }
  const Eigen::Vector4d w = allocation_ * thrusts;
  return {w[0], w.tail<3>()};
}

}  // namespace pointflight
