// A vehicle file as parameters of ArduPilot.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "pointflight/vehicle/airframe.hpp"

namespace pointflight {

/// What ArduCopter (4.3 and later) has to know of a quadrotor in an X that `ArduPilotLink` lets it
/// fly: frame, outputs, thrust curve, hover throttle, and gains of the rate and angle loops, each
/// with its value.
///
/// The attitude loop of the file, of natural frequency w and damping z, is ArduPilot's cascade with
/// the gains w / (2 z) of angles and 2 z w of rates; a unit of its roll, pitch or yaw output
/// changes each motor's thrust by half of the greatest (AP_MotorsMatrix, factors of +-0.5).
/// Integral and derivative gains keep the ratios of ArduCopter's own defaults. Throws InputError
/// for other vehicles: ArduPilot numbers the motors of each frame in its own way.
std::vector<std::pair<std::string, double>> ardupilot_parameters(const VehicleSettings& vehicle);

/// As a parameter file of Mission Planner, MAVProxy and `arducopter --defaults`.
std::string ardupilot_parameter_file(const VehicleSettings& vehicle);

}  // namespace pointflight
