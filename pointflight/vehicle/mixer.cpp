#include "pointflight/vehicle/mixer.hpp"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <cassert>
#include <cmath>

#include "pointflight/core/argument.hpp"
#include "pointflight/core/constants.hpp"
#include "pointflight/core/input_error.hpp"
#include "pointflight/vehicle/bounded_least_squares.hpp"
#include "pointflight/vehicle/internal/mixer-inl.hpp"
#include "pointflight/vehicle/internal/scalar_numbers-inl.hpp"

namespace pointflight {

namespace hw = HWY_NAMESPACE;

namespace {

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
    : settings_(settings), weight_(settings.mass * kGravity) {
  require_argument(settings.rotors.size() <= kMostRotors, "Mixer: more than kMostRotors");
  const RotorModel& rotor = settings.rotor;
  model_.thrust_min = rotor.thrust_coefficient * rotor.speed_min * rotor.speed_min;
  model_.thrust_max = rotor.thrust_coefficient * rotor.speed_max * rotor.speed_max;
  const auto n = static_cast<Eigen::Index>(settings.rotors.size());
  allocation_.resize(4, n);
  const double torque_per_thrust = rotor.torque_coefficient / rotor.thrust_coefficient;
  for (Eigen::Index i = 0; i < n; ++i) {
    const RotorPlacement& place = settings.rotors[static_cast<std::size_t>(i)];
    // r x T e3 = (y, -x, 0) T
    allocation_.col(i) << 1.0, place.position.y(), -place.position.x(),
        place.yaw_sign * torque_per_thrust;
  }
  const Eigen::Matrix4d square = allocation_ * allocation_.transpose();
  const Eigen::FullPivLU<Eigen::Matrix4d> lu(square);
  if (lu.rank() < 4) {
    throw InputError(
        fmt::format("{}: rotors: this layout cannot make thrust, roll, pitch and yaw by itself",
                    settings.path));
  }
  const Eigen::MatrixXd inverse = allocation_.transpose() * lu.inverse();
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index k = 0; k < 4; ++k) {
      model_.inverse[static_cast<std::size_t>(i)][static_cast<std::size_t>(k)] = inverse(i, k);
    }
  }
}

/// Along a rotor's axis, m/s.
double Mixer::climb_of(std::size_t rotor, const AirMotion& motion) const {
  return hw::climb_of(
      settings_.rotors[rotor], hw::numbers_of(motion.v_body), hw::numbers_of(motion.omega_body));
}

std::vector<double> Mixer::speeds(const Wrench& wrench, const AirMotion& motion) const {
  hw::PerRotor<double> speeds;
  hw::speeds_for(settings_,
                 model_,
                 hw::WrenchNumbers<double>{wrench.thrust, hw::numbers_of(wrench.torque)},
                 hw::numbers_of(motion.v_body),
                 hw::numbers_of(motion.omega_body),
                 speeds);
  return {speeds.begin(), speeds.begin() + static_cast<std::ptrdiff_t>(settings_.rotors.size())};
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
    low[i] = square * model_.thrust_min / even;
    high[i] = square * model_.thrust_max / even;
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
        settings_.rotor.speed_for(thrusts[static_cast<Eigen::Index>(i)], climb_of(i, motion));
    speeds[i] =
        std::clamp(turning / shares[i], settings_.rotor.speed_min, settings_.rotor.speed_max);
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
    thrusts[static_cast<Eigen::Index>(i)] =
        settings_.rotor.thrust_coefficient * speeds[i] * speeds[i] *
        settings_.rotor.thrust_share(climb_of(i, motion), speeds[i]);
  }
  const Eigen::Vector4d w = allocation_ * thrusts;
  return {w[0], w.tail<3>()};
}

}  // namespace pointflight
