#include "pointflight/vehicle/mixer.hpp"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <cassert>
#include <cmath>

#include "pointflight/core/input_error.hpp"

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

}  // namespace

Mixer::Mixer(const VehicleSettings& settings)
    : rotor_(settings.rotor),
      places_(settings.rotors),
      thrust_coefficient_(settings.rotor.thrust_coefficient),
      thrust_min_(thrust_coefficient_ * settings.rotor.speed_min * settings.rotor.speed_min),
      thrust_max_(thrust_coefficient_ * settings.rotor.speed_max * settings.rotor.speed_max) {
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
