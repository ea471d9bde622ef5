#include "pointflight/fidelity/sensor_lines.hpp"

#include "pointflight/core/argument.hpp"

namespace pointflight {

std::vector<Hit> render_lines(const Pose& T_world_sensor,
                              std::span<const Vector3f> origins_sensor,
                              std::span<const Vector3f> directions_sensor,
                              float range_max,
                              const Renderer& renderer,
                              const Executor& executor) {
  require_argument(origins_sensor.empty() || origins_sensor.size() == directions_sensor.size(),
                   "render_lines: an origin for each direction is wanted, or none");
  std::vector<Ray> rays(directions_sensor.size());
  for (std::size_t i = 0; i < rays.size(); ++i) {
    rays[i].origin_world = T_world_sensor.translation;
    if (!origins_sensor.empty()) {
      rays[i].origin_world = T_world_sensor * origins_sensor[i].cast<double>();
    }
    rays[i].direction_world =
        (T_world_sensor.rotation * directions_sensor[i].cast<double>()).cast<float>();
    rays[i].range_max = range_max;
  }
  std::vector<Hit> hits(rays.size());
  RayBatch batch;
  batch.rays = rays;
  batch.T_world_sensor = T_world_sensor;
  batch.range_max = range_max;
  renderer.render(batch, hits, executor);
  return hits;
}

std::vector<Hit> render_lines(const Pose& T_world_sensor,
                              std::span<const Beam> beams,
                              float range_max,
                              const Renderer& renderer,
                              const Executor& executor) {
  std::vector<Vector3f> origins;
  std::vector<Vector3f> directions;
  for (const Beam& beam : beams) {
    origins.push_back(beam.origin_sensor);
    directions.push_back(beam.direction_sensor);
  }
  return render_lines(T_world_sensor, origins, directions, range_max, renderer, executor);
}

}  // namespace pointflight
