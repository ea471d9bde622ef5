// Points of clouds that others send: PointCloud2 of any layout, Livox' own message.
#pragma once

#include <cstdint>
#include <limits>
#include <vector>

#include "pointflight/geometry/types.hpp"
#include "ros_common/messages.hpp"

namespace pointflight {

/// A point of somebody's cloud.
struct CloudMessagePoint {
  Vector3d position = Vector3d::Zero();  ///< In the cloud's frame, m; may be NaN.
  float intensity = 0.0f;                ///< In its own scale; 0 without.
  /// After the cloud's stamp or since 1970, s; NaN where it has none.
  double time = std::numeric_limits<double>::quiet_NaN();
  std::int32_t ring = -1;  ///< ring, line, channel; -1 where it has none.
};

/// The points of a cloud, all of them, and what they carry.
struct CloudMessagePoints {
  std::vector<CloudMessagePoint> points;  ///< In the cloud's order.
  bool has_intensity = false;             ///< intensity, reflectivity, i
  bool has_times = false;                 ///< t, time, timestamp, time_stamp, offset_time
};

/// Reads x, y, z, an intensity and times: whole numbers are ns; others are s, or, where they are
/// beyond 1e11, ns. Throws InputError that says what is wrong with the cloud.
CloudMessagePoints points_of(const msg::PointCloud2& cloud);

/// The same of Livox' message; times are after its stamp.
CloudMessagePoints points_of(const msg::CustomMsg& cloud);

}  // namespace pointflight
