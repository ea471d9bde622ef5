// What deskewing leaves in a scan, because the motion that it takes out was estimated.
#pragma once

#include <cstdint>

#include "pointflight/core/time.hpp"
#include "pointflight/geometry/types.hpp"
#include "pointflight/lidar/lidar_settings.hpp"

namespace pointflight {

/// Motion that is left within a scan: points turn and shift in proportion to their time, not at all
/// in the middle of the scan, to which its pose belongs.
struct ResidualMotion {
  Vector3d rotation = Vector3d::Zero();     ///< Over a scan, rotation vector, rad, sensor frame.
  Vector3d translation = Vector3d::Zero();  ///< Over a scan, m, sensor frame.

  /// Where a point ends up. `time`: of its beam, as a share of the scan's duration. To first order
  /// in the rotation.
  [[nodiscard]] Vector3f moved(const Vector3f& point_sensor, double time) const;
};

/// That of the scan which starts at `start`: it changes within seconds, as motion does.
/// `sensor`: the entity of its random streams.
ResidualMotion residual_motion(const DeskewingSettings& settings,
                               std::uint64_t seed,
                               std::uint32_t sensor,
                               SimTime start);

}  // namespace pointflight
