#include "pointflight/vehicle/motor_outputs.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

namespace pointflight {
namespace {

/// Numbers of the rotors front right, rear left, front left, rear right; empty if there is not one
/// in each quarter.
std::vector<std::size_t> x_order(const std::vector<RotorPlacement>& rotors) {
  constexpr std::array<std::array<double, 2>, 4> kQuarters = {
      {{1.0, -1.0}, {-1.0, 1.0}, {1.0, 1.0}, {-1.0, -1.0}}};
  std::vector<std::size_t> order;
  for (const auto& [x, y] : kQuarters) {
    for (std::size_t i = 0; i < rotors.size(); ++i) {
      const Vector3d& p = rotors[i].position;
      if (x * p.x() <= 0.0 || y * p.y() <= 0.0) continue;
      order.push_back(i);
      break;
    }
  }
  return rotors.size() == 4 && order.size() == 4 ? order : std::vector<std::size_t>{};
}

}  // namespace

MotorOutputs::MotorOutputs(const VehicleSettings& vehicle)
    : speed_min_(vehicle.rotor.speed_min),
      speed_max_(vehicle.rotor.speed_max),
      hover_speed_(vehicle.hover_speed()),
      rotors_(x_order(vehicle.rotors)),
      is_x_quad_(!rotors_.empty()) {
  if (is_x_quad_) return;
  rotors_.resize(vehicle.rotors.size());
  std::iota(rotors_.begin(), rotors_.end(), std::size_t{0});
}

std::vector<double> MotorOutputs::speeds(std::span<const float> outputs, bool is_armed) const {
  std::vector<double> speeds(rotors_.size(), 0.0);
  if (!is_armed) return speeds;
  for (std::size_t i = 0; i < rotors_.size(); ++i) {
    const double u = i < outputs.size() && std::isfinite(outputs[i])
                         ? std::clamp(static_cast<double>(outputs[i]), 0.0, 1.0)
                         : 0.0;
    speeds[rotors_[i]] = speed_min_ + u * (speed_max_ - speed_min_);
  }
  return speeds;
}

double MotorOutputs::output_of(double speed) const {
  return (speed - speed_min_) / (speed_max_ - speed_min_);
}

double MotorOutputs::square_share() const {
  // thrust goes with the square of the speed a + (1 - a) u; T - u = f (u^2 - u)
  const double a = speed_min_ / speed_max_;
  double product = 0.0;
  double square = 0.0;
  constexpr int kSteps = 100;
  for (int i = 0; i <= kSteps; ++i) {
    const double u = static_cast<double>(i) / kSteps;
    const double speed = a + (1.0 - a) * u;
    const double bend = u * u - u;
    product += (speed * speed - u) * bend;
    square += bend * bend;
  }
  return std::clamp(product / square, 0.0, 1.0);
}

}  // namespace pointflight
