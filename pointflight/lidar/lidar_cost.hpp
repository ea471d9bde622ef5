#pragma once

#include <string>

#include "pointflight/lidar/lidar_settings.hpp"

namespace pointflight {

/// What a LiDAR costs in a flight, to within a half: cores (CPU time per simulated second) of the
/// machine of docs/performance.md, "Shipped LiDARs".
struct LidarCostClass {
  std::string name;   ///< light, moderate, heavy, very heavy.
  double low = 0.0;   ///< Cores, in a hall,
  double high = 0.0;  ///< and in a forest, where most beams hit several things.
  double line = 0.0;  ///< With beams as lines.
  bool wide = false;  ///< As the sensor is, its beams have a width.
};

/// Of a sensor that fires so many beams per second.
[[nodiscard]] LidarCostClass cost_class_of(const LidarSettings& settings, double beams_per_second);

}  // namespace pointflight
