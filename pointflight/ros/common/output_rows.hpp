// The table of outputs in its parts; `output_types` joins them in this order.
#pragma once

#include <vector>

#include "pointflight/ros/common/output.hpp"

namespace pointflight {

/// Clock, map and static transforms: what others need before anything else.
std::vector<OutputType> leading_outputs();
/// Of each vehicle: states, IMU, markers.
std::vector<OutputType> vehicle_outputs();
/// Of each vehicle: barometers and the like, if it has them.
std::vector<OutputType> navigation_outputs();
/// Of each LiDAR: clouds and pictures.
std::vector<OutputType> lidar_outputs();
/// Obstacles, collisions, diagnostics.
std::vector<OutputType> trailing_outputs();

}  // namespace pointflight
