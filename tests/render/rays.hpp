// Rays that tests render.
#pragma once

#include <vector>

#include "pointflight/core/constants.hpp"
#include "pointflight/lidar/beam_pattern.hpp"
#include "pointflight/render/renderer.hpp"

namespace pointflight::testing {

/// A grid of rays from one origin, `step_deg` apart.
inline std::vector<Ray> fan(const Vector3d& origin,
                            double half_width_deg,
                            double half_height_deg,
                            double step_deg,
                            float range_max = 50.0f,
                            double yaw_deg = 0.0) {
  std::vector<Ray> rays;
  for (double el = -half_height_deg; el <= half_height_deg; el += step_deg) {
    for (double az = -half_width_deg; az <= half_width_deg; az += step_deg) {
      rays.push_back(
          {origin, direction_of((az + yaw_deg) * kDegree, el * kDegree).cast<float>(), range_max});
    }
  }
  return rays;
}

inline std::vector<Hit> render(const Renderer& renderer,
                               const std::vector<Ray>& rays,
                               int threads = 2) {
  std::vector<Hit> hits(rays.size());
  RayBatch batch;
  batch.rays = rays;
  batch.T_world_sensor.translation = rays.front().origin_world;
  batch.range_max = rays.front().range_max;
  const Executor executor(threads);
  renderer.render(batch, hits, executor);
  return hits;
}

}  // namespace pointflight::testing
