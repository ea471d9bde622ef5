// Points of clouds that others send: PointCloud2 of any layout, Livox' own message.
#pragma once

#include <vector>

#include "pointflight/io/recorded_point.hpp"
#include "pointflight/ros/common/messages.hpp"

namespace pointflight {

/// The points of a cloud, all of them, and what they carry.
struct CloudMessagePoints {
  std::vector<RecordedPoint> points;  ///< In the cloud's order.
  bool has_intensity = false;         ///< intensity, reflectivity, i
  double time_unit = 1.0;             ///< That times were taken to be in, s.
};

/// Reads x, y, z, an intensity and times: whole numbers are ns; others are s, or, if they are
/// beyond 1e11, ns. Throws InputError that says what is wrong with the cloud.
CloudMessagePoints points_of(const msg::PointCloud2& cloud);

/// The same of Livox' message; times are after its stamp.
CloudMessagePoints points_of(const msg::CustomMsg& cloud);

}  // namespace pointflight
