#pragma once

namespace pointflight {

inline constexpr double kPi = 3.14159265358979323846;  ///< Half a turn in radians.
inline constexpr double kLightSpeed = 299792458.0;     ///< m/s, in vacuum.
inline constexpr double kDegree = kPi / 180.0;         ///< One degree in radians.

/// Standard gravity as the dynamics use it, m/s^2. One value everywhere: dynamics, IMU,
/// controllers.
inline constexpr double kGravity = 9.81;

/// Air density at sea level, 15 deg C (ISO 2533), kg/m^3.
inline constexpr double kAirDensity = 1.225;

}  // namespace pointflight
