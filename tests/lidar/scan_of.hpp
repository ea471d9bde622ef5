#pragma once

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "pointflight/core/constants.hpp"
#include "pointflight/lidar/beam_pattern.hpp"
#include "pointflight/lidar/lidar_settings.hpp"

/// What tests of scan patterns share.
namespace pointflight::testing {

struct Angles {
  double azimuth_deg;
  double elevation_deg;
};

inline Angles angles_of(const Beam& beam) {
  const Vector3d d = beam.direction_sensor.cast<double>();
  return {std::atan2(d.y(), d.x()) / kDegree, std::asin(std::clamp(d.z(), -1.0, 1.0)) / kDegree};
}

/// The beams of a shipped sensor, or of one at a path.
inline std::vector<Beam> scan_of(const std::string& name, std::uint64_t index = 0) {
  const Executor executor(2);
  return make_pattern(load_lidar(name))->beams(index, executor);
}

}  // namespace pointflight::testing
