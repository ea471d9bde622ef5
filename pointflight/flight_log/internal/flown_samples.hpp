// What a fit works on: the instants of a log at which the vehicle flew.
#pragma once

#include <cstddef>
#include <vector>

#include "pointflight/flight_log/flight_log.hpp"

namespace pointflight::flight_log {

/// Rotor outputs that hold from an instant on.
struct HeldOutputs {
  double from = 0.0;  ///< s
  const LoggedOutputs* given = nullptr;
};

/// An IMU sample in flight, and what had been given to the motors since the one before.
struct FlownSample {
  double time = 0.0;               ///< s
  RigidBodyState state;            ///< As logged; rates as measured.
  Vector3d accel;                  ///< As measured, m/s^2, body.
  std::size_t stretch = 0;         ///< Samples of one follow each other without a gap.
  bool is_settling = false;        ///< Rotors may still remember what was before the stretch.
  std::vector<HeldOutputs> since;  ///< From the sample before it on, ascending; never empty.
};

/// Those of a log between two times: armed, off the ground (half a metre above where it was armed,
/// if it was armed in the log), motors well above idling.
std::vector<FlownSample> flown_samples(const FlightLog& log,
                                       const VehicleSettings& vehicle,
                                       double from,
                                       double until);

/// Throws InputError if a log has less outputs than the vehicle has rotors.
void require_outputs(const FlightLog& log, const VehicleSettings& vehicle);

}  // namespace pointflight::flight_log
