// A vehicle file as parameters of PX4.
#pragma once

#include <string>
#include <vector>

#include "pointflight/vehicle/airframe.hpp"

namespace pointflight {

/// A parameter, by PX4's name.
struct Px4Parameter {
  std::string name;         ///< "MPC_THR_HOVER"
  double value = 0.0;       ///< In PX4's units.
  bool is_integer = false;  ///< INT32; else REAL32.
};

/// What PX4 (1.14 and later) has to know of a vehicle that `Px4Link` lets it fly: geometry and turn
/// of the rotors in the order of `MotorOutputs`, thrust curve, hover thrust, tilt, and gains of the
/// rate and attitude loops. With `vision` it flies by external vision, without satellites.
///
/// The attitude loop of the file, of natural frequency w and damping z, is PX4's cascade with the
/// gains w / (2 z) of angles and 2 z w of rates; a unit of PX4's torque turns by what its control
/// allocation makes of it (ControlAllocationPseudoInverse: columns of the pseudo-inverse, scaled to
/// a root of the summed squares of sqrt(n / 2) over n rotors). Integral and derivative gains keep
/// the ratios of PX4's own defaults. Throws InputError if the rotors cannot turn it about each
/// axis.
std::vector<Px4Parameter> px4_parameters(const VehicleSettings& vehicle, bool vision);

/// As a parameter file of QGroundControl, which `param load` reads too.
std::string px4_parameter_file(const VehicleSettings& vehicle, bool vision);

}  // namespace pointflight
