// Many flights at once, a vehicle in each lane.
#pragma once

#include <cstddef>

#include "pointflight/vehicle/airframe.hpp"
#include "pointflight/vehicle/flight_batch.hpp"
#include "pointflight/vehicle/internal/loop_gains.hpp"
#include "pointflight/vehicle/internal/rotor_lag.hpp"
#include "pointflight/vehicle/mixer.hpp"

namespace pointflight {

/// What is kept of each vehicle: rows of a table with a column a vehicle.
enum FlightRow : std::size_t {
  kPosition = 0,           ///< 3
  kVelocity = 3,           ///< 3
  kOrientation = 6,        ///< 4: x, y, z, w
  kRates = 10,             ///< 3
  kVelocityIntegral = 13,  ///< 3
  kYawTorque = 16,
  kYaw = 17,        ///< That it is asked for, rad.
  kAsked = 18,      ///< 3: velocity, acceleration or body rates.
  kAskedTurn = 21,  ///< Yaw rate, or thrust of body rates.
  kWind = 22,       ///< 3
  kGround = 25,
  kLoadShare = 26,
  kRotorRows = 27,  ///< Then speeds, accelerations, commands and shares of the rotors.
};

/// The rows of one batch, `stride` columns each.
struct FlightTable {
  double* rows = nullptr;
  std::size_t stride = 0;
  [[nodiscard]] double* row(std::size_t r) const { return rows + r * stride; }
};

/// Columns come in groups of so many: the widest vector.
inline constexpr std::size_t kFlightLanes = 8;

/// How the vehicles of a batch fly.
struct FlightPlan {
  const VehicleSettings* vehicle = nullptr;
  const LoopGains* gains = nullptr;
  const MixerModel* mixer = nullptr;
  StepLag lag;              ///< Of one Runge-Kutta step.
  int parts = 2;            ///< Runge-Kutta steps in a physics step.
  int held = 1;             ///< Physics steps in a control period.
  double control_dt = 0.0;  ///< s
};

/// `periods` control periods of the vehicles in columns [begin, end), both multiples of
/// `kFlightLanes`.
void fly_on(const FlightPlan& plan,
            const FlightTable& table,
            FlightLevel level,
            std::size_t begin,
            std::size_t end,
            int periods);

}  // namespace pointflight
