#include "pointflight/vehicle/battery.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace pointflight {
namespace {

constexpr double kFullCell = 4.2;   // V
constexpr double kEmptyCell = 3.5;  // V
constexpr double kHour = 3600.0;    // s

}  // namespace

double Battery::step(BatteryState& state, double shaft_power, double dt) const {
  const BatterySettings& b = settings_.battery;
  assert(b.capacity > 0.0 && b.cells > 0.0);
  const double power = shaft_power / b.efficiency;
  const double open = b.cells * (kEmptyCell + charge(state) * (kFullCell - kEmptyCell));
  // V = V_open - R P / V; if it cannot give the power, what it can give at most
  state.voltage = 0.5 * (open + std::sqrt(std::max(0.0, open * open - 4.0 * b.resistance * power)));
  state.current = power / state.voltage;
  state.used = std::min(b.capacity, state.used + state.current * dt / kHour);
  return std::min(1.0, state.voltage / (b.cells * kFullCell));
}

double Battery::charge(const BatteryState& state) const {
  return std::max(0.0, 1.0 - state.used / settings_.battery.capacity);
}

}  // namespace pointflight
