// Sensors that scenarios can mount besides LiDARs, odometry and IMU: `sensors: [{kind: gnss}]`.
#pragma once

#include <cstdint>
#include <vector>

#include "pointflight/core/random.hpp"
#include "pointflight/sim/sensor.hpp"

namespace pointflight {

/// Static pressure at the body, by `EarthOrigin::altitude`. Defaults: TE Connectivity MS5611-01BA03
/// (1.2 Pa RMS at its highest resolution, 150 Pa absolute accuracy taken as two deviations).
struct BarometerSettings {
  double rate = 50.0;            ///< Hz
  double noise = 1.2;            ///< White, Pa.
  double offset = 75.0;          ///< Deviation from run to run, Pa.
  double drift = 0.5;            ///< Random walk, Pa/sqrt(s): weather and temperature. Assumed.
  double sea_pressure = 101325;  ///< At sea level, Pa.
};
/// Its keys.
void describe(SettingsVisitor& visitor, BarometerSettings& settings);

/// Pressure by the international standard atmosphere (ISO 2533) up to 11 km:
/// p0 (1 - 2.25577e-5 h)^5.25588.
double standard_pressure(double altitude, double sea_pressure);

/// The earth's field in body axes. Defaults: Honeywell HMC5883L (2 mG noise floor), field as in
/// central Europe.
struct MagnetometerSettings {
  double rate = 75.0;             ///< Hz
  double noise = 0.2;             ///< White, of each axis, uT.
  double hard_iron = 2.0;         ///< Deviation of each axis' offset from run to run, uT. Assumed.
  double scale_error = 0.01;      ///< Deviation of each axis' scale from run to run. Assumed.
  double field = 48.0;            ///< uT
  double inclination_deg = 65.0;  ///< Below the horizon.
  double declination_deg = 3.0;   ///< Of magnetic north, from true north (world y) to the east.
};
/// Its keys.
void describe(SettingsVisitor& visitor, MagnetometerSettings& settings);

/// A time without satellites.
struct Outage {
  double from = 0.0;   ///< s
  double until = 0.0;  ///< s
};

/// Satellite navigation, by `EarthOrigin`. Defaults: u-blox NEO-M8N (2.5 m CEP, 0.05 m/s, 10
/// Hz; 2.5 m CEP is a deviation of 2.1 m on each axis).
struct GnssSettings {
  double rate = 10.0;             ///< Hz
  double horizontal = 2.1;        ///< Deviation of the slow error, east and north, m.
  double vertical = 3.2;          ///< The same, up, m. Assumed: half as much again.
  double correlation = 300.0;     ///< Time constant of the slow error, s. Assumed.
  double noise = 0.1;             ///< White, of each coordinate, m. Assumed.
  double velocity_noise = 0.05;   ///< White, of each component, m/s.
  double latency = 0.12;          ///< Until a fix arrives, s. Assumed.
  std::vector<Outage> outages{};  ///< No fixes then.
};
/// Its keys.
void describe(SettingsVisitor& visitor, GnssSettings& settings);

/// A position on the earth (WGS 84).
struct GeodeticPosition {
  double latitude = 0.0;   ///< deg
  double longitude = 0.0;  ///< deg
  double altitude = 0.0;   ///< Above the ellipsoid, m.
};
/// Of a position in a world whose x is east, y north at an origin; by the radii of curvature there:
/// within 1 cm up to some 2 km from it.
GeodeticPosition geodetic(const GeodeticPosition& origin, const Vector3d& p_world);

/// Distance to the map along one ray. Defaults: Benewake TFmini Plus (0.1 to 12 m, 100 Hz, 5 cm up
/// to 6 m and 1 % beyond, taken as two deviations), looking down.
struct RangeFinderSettings {
  double rate = 100.0;                             ///< Hz
  double range_min = 0.1;                          ///< m
  double range_max = 12.0;                         ///< m
  double noise = 0.025;                            ///< Deviation up to 6 m ..
  double noise_share = 0.005;                      ///< .. or this share of the range, if more.
  Vector3d position = Vector3d::Zero();            ///< m, body frame.
  Vector3d rotation_rpy_deg = Vector3d(0, 90, 0);  ///< Of its axes; it looks along its x.
};
/// Its keys.
void describe(SettingsVisitor& visitor, RangeFinderSettings& settings);

/// Adds these four kinds to a table.
void add_navigation_sensors(Registry<SensorKind>& kinds);

}  // namespace pointflight
