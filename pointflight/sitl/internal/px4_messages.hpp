// What sensors and the truth are in PX4's messages: other frames and units, and nothing added.
#pragma once

#include <cstdint>
#include <vector>

#include "pointflight/sim/navigation_sensors.hpp"
#include "pointflight/sitl/internal/mavlink.hpp"

namespace pointflight {

/// Of a barometer's values, for the next HIL_SENSOR: its altitude and temperature are those of the
/// standard atmosphere.
void put_pressure(const std::vector<double>& values, mavlink::HilSensor& sensor);
/// Of a magnetometer's values, the same.
void put_field(const std::vector<double>& values, mavlink::HilSensor& sensor);

/// Of a fix's values.
mavlink::HilGps gps_of(const std::vector<double>& values,
                       const EarthOrigin& origin,
                       std::uint64_t time_usec);

/// Of a range finder's values; nothing seen is a distance beyond the greatest.
mavlink::DistanceSensor distance_of(const std::vector<double>& values,
                                    const RangeFinderSettings& mount,
                                    std::uint64_t time_usec);

/// `a_world`: the acceleration, m/s^2.
mavlink::HilStateQuaternion truth_of(const RigidBodyState& body,
                                     const Vector3d& a_world,
                                     const EarthOrigin& origin,
                                     std::uint64_t time_usec);

/// Odometry as external vision.
mavlink::Odometry vision_of(const OdometrySample& sample, std::uint64_t time_usec);

/// Distances in the level body frame at the end of the scan, clockwise from the front, of what
/// stands within `band` (m) of the vehicle's height. A direction is known if anything came back
/// from it.
mavlink::ObstacleDistance obstacles_of(const ScanSample& sample,
                                       const Pose& T_body_lidar,
                                       double band,
                                       std::uint64_t time_usec);

}  // namespace pointflight
