// A vehicle file from one of PX4's airframes.
#pragma once

#include <string>
#include <string_view>

#include "pointflight/vehicle/airframe.hpp"

namespace pointflight {

/// `like` with the rotors of an airframe: a start script of PX4 (`param set-default CA_ROTOR0_PX
/// 0.15`, ROMFS/px4fmu_common/init.d*/airframes) or a parameter file of QGroundControl. Rotors
/// keep PX4's order; the ratio of torque to thrust is theirs (CA_ROTORn_KM, the mean of their
/// sizes). An airframe says nothing of mass, inertia and thrust: those stay `like`'s. Throws
/// InputError, with file and line, if rotors are missing, out of limits, or tilted.
VehicleSettings vehicle_from_px4_airframe(std::string_view text,
                                          const std::string& path,
                                          const VehicleSettings& like);

}  // namespace pointflight
