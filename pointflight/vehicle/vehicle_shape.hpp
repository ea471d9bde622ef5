#pragma once

#include "pointflight/geometry/assembly.hpp"
#include "pointflight/vehicle/airframe.hpp"

namespace pointflight {

/// What LiDARs see of a vehicle, in the body frame: a box in the middle, an arm and a motor for
/// each rotor, and propellers that turn at hover speed, each from an angle of its own. What the
/// file's `airframe` leaves out follows from where the rotors sit.
Assembly assembly_of(const VehicleSettings& settings);

}  // namespace pointflight
