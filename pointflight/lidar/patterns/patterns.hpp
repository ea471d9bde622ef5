#pragma once

#include <memory>

#include "pointflight/lidar/beam_pattern.hpp"

/// One maker per scan principle; the table of names is in beam_pattern.cpp.
namespace pointflight {

std::unique_ptr<BeamPattern> make_rotor_pattern(const LidarSettings& settings);
std::unique_ptr<BeamPattern> make_prisms_pattern(const LidarSettings& settings);
std::unique_ptr<BeamPattern> make_rings_pattern(const LidarSettings& settings);
std::unique_ptr<BeamPattern> make_grid_pattern(const LidarSettings& settings);
std::unique_ptr<BeamPattern> make_csv_pattern(const LidarSettings& settings);

}  // namespace pointflight
