#pragma once

#include <memory>
#include <string>

#include "apps/canvas.hpp"
#include "pointflight/lidar/lidar_settings.hpp"

namespace pointflight::apps {

/// A sensor's pattern after 0.1 s and after 1 s, and how its coverage grows. Throws InputError if
/// it cannot be written.
void draw_lidar(const LidarSettings& lidar, const std::string& path);

/// Its page, for tests of what is written on it.
std::unique_ptr<Canvas> lidar_page(const LidarSettings& lidar);

}  // namespace pointflight::apps
