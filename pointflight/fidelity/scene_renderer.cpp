#include "pointflight/fidelity/scene_renderer.hpp"

#include <cmath>

namespace pointflight {

void SceneRenderer::render_one(const RenderJob& job, const Executor& executor) const {
  executor.parallel_for(job.hits.size(), 512, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const Ray& ray = job.batch.rays[i];
      const Vector3d d = ray.direction_world.cast<double>().normalized();
      const auto found = tree_.intersect(ray.origin_world, d);
      Hit& hit = job.hits[i] = {};
      if (!found || found->range > static_cast<double>(ray.range_max)) continue;
      const Vector3d at = ray.origin_world + found->range * d;
      hit.range = static_cast<float>(found->range);
      hit.cos_incidence =
          static_cast<float>(std::abs(normal_at(scene_.geometry.shapes[found->shape], at).dot(d)));
    }
  });
}

}  // namespace pointflight
