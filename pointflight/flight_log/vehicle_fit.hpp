// A vehicle's figures from a log of its flight.
#pragma once

#include <limits>
#include <string>
#include <vector>

#include "pointflight/core/parallel.hpp"
#include "pointflight/core/progress.hpp"
#include "pointflight/flight_log/flight_log.hpp"
#include "pointflight/vehicle/airframe.hpp"

namespace pointflight {

/// One figure of a vehicle file beside what a log says of it.
struct FittedFigure {
  std::string key;      ///< "rotor.thrust_coefficient"
  std::string unit;     ///< "N s^2"; empty: none.
  double before = 0.0;  ///< In the file that was given.
  double value = 0.0;   ///< In the new one.
  double sigma = 0.0;   ///< Standard deviation of `value`; of what the log says if it is not told.
  bool is_told = true;  ///< False: the log cannot tell, and `value` is `before`.
  std::string remark;   ///< What it rests on, or why it is not told.
};

/// How far a model is off a log, root of the mean square.
struct LogResiduals {
  Vector3d accel = Vector3d::Zero();  ///< Specific force, m/s^2, body.
  Vector3d gyro = Vector3d::Zero();   ///< Rates within half a second, rad/s, body.
};

/// Part of a log that is used.
struct VehicleFitOptions {
  double from = 0.0;                                       ///< s, in the log's time.
  double until = std::numeric_limits<double>::infinity();  ///< s
  Progress progress;                                       ///< Of the steps of the fit.
};

/// A vehicle that flies as the log has it.
struct VehicleFit {
  VehicleSettings vehicle;            ///< The one that was given, with the figures that are told.
  std::vector<FittedFigure> figures;  ///< Told or not.
  double flown = 0.0;                 ///< s of the log that were used.
  LogResiduals before;                ///< Of the vehicle that was given.
  LogResiduals after;                 ///< Of the one that was found.
};

/// Fits thrust, its curve, motor lag, drag and inertia of `like` to a log by least squares
/// (Gauss-Newton): `Multirotor` is given the logged attitude, velocity and outputs; the specific
/// force that it feels, and the rates that it turns by within half a second, are compared with what
/// the IMU measured. Constant wind, biases of the accelerometer and a constant torque (a centre of
/// mass that is off) are found along with them. Deviations are those of stretches of a second
/// against each other (White 1980, clustered), so that noise may be correlated within one; the
/// scales of the IMU, which the log cannot tell from thrust and inertia, come on top as the file
/// has them.
///
/// A log knows no masses, no forces and no rotor speeds: mass, greatest speed and the ratio of
/// torque to thrust stay those of the file, and thrust and inertia are found in proportion to the
/// mass. Throws InputError if there are less than ten seconds of flight, or less outputs than
/// rotors.
VehicleFit fit_vehicle(const FlightLog& log,
                       const VehicleSettings& like,
                       const Executor& executor,
                       const VehicleFitOptions& options = {});

}  // namespace pointflight
