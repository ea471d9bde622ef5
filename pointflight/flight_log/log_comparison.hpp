// How true a vehicle file is to a log of the vehicle's flight.
#pragma once

#include <cstddef>
#include <limits>
#include <vector>

#include "pointflight/core/progress.hpp"
#include "pointflight/flight_log/flight_log.hpp"
#include "pointflight/vehicle/airframe.hpp"

namespace pointflight {

/// How the outputs of a log are flown again.
struct LogComparisonOptions {
  /// s; the vehicle is put where the log has it again and again after so long, for what is flown
  /// without looking goes its own way soon.
  double window = 0.5;
  double from = 0.0;                                       ///< s, in the log's time.
  double until = std::numeric_limits<double>::infinity();  ///< s
  Progress progress;                                       ///< Of the log.
};

/// The log and the flight of its outputs at an IMU sample.
struct ComparedSample {
  double time = 0.0;         ///< s, in the log's time.
  double in_window = 0.0;    ///< s since the vehicle was put where the log has it.
  LoggedImu logged;          ///< As measured.
  LoggedImu flown;           ///< As an ideal IMU would measure it.
  double tilt_error = 0.0;   ///< Between the body's z axes, rad.
  double turn_error = 0.0;   ///< The whole angle between the attitudes, rad.
  double speed_error = 0.0;  ///< m/s
};

/// All of them, and roots of their mean squares.
struct LogComparison {
  std::vector<ComparedSample> samples;    ///< By time.
  std::size_t windows = 0;                ///< How often the vehicle was put back.
  Vector3d accel_rms = Vector3d::Zero();  ///< m/s^2, body axes.
  Vector3d gyro_rms = Vector3d::Zero();   ///< rad/s, body axes.
  double tilt_rms = 0.0;                  ///< At the ends of windows, rad.
  double turn_rms = 0.0;                  ///< At the ends of windows, rad.
  double speed_rms = 0.0;                 ///< At the ends of windows, m/s.
};

/// Flies the logged outputs by the equations of `vehicle`, in calm air. Throws InputError if there
/// is less than a window of flight, or if there are less outputs than rotors.
LogComparison fly_outputs(const FlightLog& log,
                          const VehicleSettings& vehicle,
                          const LogComparisonOptions& options = {});

/// From the first to the last sample in flight.
struct FlownTime {
  double from = 0.0;   ///< s, in the log's time.
  double until = 0.0;  ///< s
};
/// Of a log. Throws InputError if there is none.
FlownTime flown_time(const FlightLog& log, const VehicleSettings& vehicle);

}  // namespace pointflight
