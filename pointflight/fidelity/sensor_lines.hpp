#pragma once

#include <span>
#include <vector>

#include "pointflight/core/parallel.hpp"
#include "pointflight/geometry/types.hpp"
#include "pointflight/lidar/beam_pattern.hpp"
#include "pointflight/render/renderer.hpp"

namespace pointflight {

/// Renders lines from a sensor, up to `range_max` (m). `origins_sensor`: m, empty (all from the
/// sensor's own) or as long as the directions, which are unit vectors.
std::vector<Hit> render_lines(const Pose& T_world_sensor,
                              std::span<const Vector3f> origins_sensor,
                              std::span<const Vector3f> directions_sensor,
                              float range_max,
                              const Renderer& renderer,
                              const Executor& executor);

/// The same along beams of a pattern.
std::vector<Hit> render_lines(const Pose& T_world_sensor,
                              std::span<const Beam> beams,
                              float range_max,
                              const Renderer& renderer,
                              const Executor& executor);

}  // namespace pointflight
