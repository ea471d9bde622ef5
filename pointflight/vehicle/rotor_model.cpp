#include <cmath>

#include "pointflight/core/math.hpp"
#include "pointflight/vehicle/airframe.hpp"
#include "pointflight/vehicle/internal/rotor-inl.hpp"
#include "pointflight/vehicle/internal/rotor_lag.hpp"

namespace pointflight {
namespace {

RotorLag lag_over(const RotorModel& rotor, double dt) {
  const double wn = rotor.natural_frequency;
  const double z = rotor.damping;
  const double decay = math::exp(-z * wn * dt);
  const double under = 1.0 - z * z;
  if (under > 1e-8) {
    const double wd = wn * std::sqrt(under);
    const auto angle = math::sincos(wd * dt);
    return {decay, angle.cos, angle.sin / wd};
  }
  if (under < -1e-8) {
    const double wd = wn * std::sqrt(-under);
    const double grow = math::exp(wd * dt);
    return {decay, 0.5 * (grow + 1.0 / grow), 0.5 * (grow - 1.0 / grow) / wd};
  }
  return {decay, 1.0, dt};
}

}  // namespace

RotorModel::Shares RotorModel::shares(double climb, double speed) const {
  const auto [thrust, torque] = HWY_NAMESPACE::shares_at(*this, climb, speed);
  return {thrust, torque};
}

double RotorModel::speed_for(double thrust, double climb) const {
  return HWY_NAMESPACE::rotor_speed_for(*this, thrust, climb);
}

StepLag step_lag(const RotorModel& rotor, double dt) {
  return {dt, lag_over(rotor, 0.5 * dt), lag_over(rotor, dt)};
}

}  // namespace pointflight
