// A flight of our own vehicle as a log of it would have it.
#pragma once

#include <cstdint>

#include "pointflight/flight_log/flight_log.hpp"
#include "pointflight/vehicle/airframe.hpp"

namespace pointflight {

/// How a flight is made and written down.
struct FlownLogOptions {
  double duration = 40.0;  ///< s
  double rate = 250.0;     ///< Of IMU and outputs, Hz.
  std::uint64_t seed = 1;  ///< Of its way and of noise.
  bool is_noisy = true;    ///< IMU of the vehicle's file; attitude and velocity off a little.
  bool hovers = false;     ///< Instead of flying to and fro.
  bool takes_off = false;  ///< The first two seconds it stands, motors off.
};

/// Flies to and fro and up and down at random, in calm air, by the vehicle's own autopilot.
FlightLog flown_log(const VehicleSettings& vehicle, const FlownLogOptions& options);

}  // namespace pointflight
