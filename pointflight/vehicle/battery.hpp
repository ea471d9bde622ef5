#pragma once

#include "pointflight/vehicle/airframe.hpp"
#include "pointflight/vehicle/state.hpp"

namespace pointflight {

/// The state of charge of a battery.
struct BatteryState {
  double used = 0.0;     ///< Ah
  double voltage = 0.0;  ///< Under the present current, V.
  double current = 0.0;  ///< A
};

/// Charge and voltage of a LiPo: open circuit 3.5 to 4.2 V per cell, in proportion to the charge
/// left; the current is the rotors' shaft power by efficiency and voltage.
class Battery {
 public:
  /// `step` and `charge` are for vehicles whose file has a battery.
  explicit Battery(const VehicleSettings& settings) : settings_(settings) {}

  /// Advances by `dt` seconds under the rotors' shaft power (W). Returns the share of the rotors'
  /// greatest speed that is left: they turn in proportion to the voltage, all of it at 4.2 V per
  /// cell.
  double step(BatteryState& state, double shaft_power, double dt) const;

  /// Share of the capacity that is left, 0 to 1.
  [[nodiscard]] double charge(const BatteryState& state) const;

 private:
  VehicleSettings settings_;
};

}  // namespace pointflight
