// Descriptions of sensors in vendors' own formats.
#pragma once

#include <string>
#include <string_view>

#include "pointflight/lidar/lidar_settings.hpp"

namespace pointflight {

/// Ouster's metadata of a unit (the .json that its driver, its SDK and its recordings keep): beams,
/// columns, turns per second, distance of the beams' origin and height are the unit's; range, noise
/// and optics those of the shipped sensor of its line. A whole turn is fired whatever its azimuth
/// window. Both layouts, the flat one up to firmware 2.1 and the one in sections. Throws
/// InputError.
LidarSettings load_ouster_metadata(const std::string& path);

/// From text, for tests and fuzzers; `path` is for messages.
LidarSettings parse_ouster_metadata(std::string_view json, const std::string& path);

/// A table of directions as Livox publishes them: azimuth and zenith (or elevation) in degrees, one
/// row per point, 4 s in all. Range, noise and optics are those of the shipped sensor with as many
/// points per second (200,000: mid360, 240,000: avia, 100,000: mid40); other numbers of rows are
/// refused: a sensor file with `pattern: csv` says their rate. Throws InputError.
LidarSettings load_livox_table(const std::string& path);

}  // namespace pointflight
