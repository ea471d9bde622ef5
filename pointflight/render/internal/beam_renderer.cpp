#include "pointflight/render/internal/beam_renderer.hpp"

#include <array>
#include <numeric>
#include <vector>

#include "pointflight/core/argument.hpp"
#include "pointflight/render/internal/body_renderer.hpp"
#include "pointflight/render/internal/direction_order.hpp"

namespace pointflight {
namespace {

constexpr std::size_t kChunk = 1024;  // rays
static_assert(kChunk % kSubRays == 0);

const SurfelMap& map_of(const Scene& scene) {
  require_argument(scene.map != nullptr, "BeamRenderer: the scene has no map");
  return *scene.map;
}

}  // namespace

BeamRenderer::BeamRenderer(const Scene& scene, BeamGrouping grouping)
    : map_(scene.map), kernel_map_(kernel_map_of(map_of(scene))), grouping_(grouping) {}

/// Traces the rays of `part`; how many lists of hits overflowed.
std::uint64_t BeamRenderer::trace_part(const RenderJob& job,
                                       std::span<const std::uint32_t> part,
                                       std::span<KernelHit> found) const {
  const std::span<const Ray> rays = job.batch.rays;
  return job.nearest.empty() ? trace_beams(kernel_map_, rays, part, found, grouping_)
                             : trace_footprints(kernel_map_, rays, part, found, job.nearest);
}

void BeamRenderer::render_one(const RenderJob& job, const Executor& executor) const {
  const RayBatch& batch = job.batch;
  std::vector<std::uint32_t> own_order;
  std::span<const std::uint32_t> order = batch.order;
  if (!job.nearest.empty()) {  // a beam's sub-rays follow each other
    own_order.resize(batch.rays.size());
    std::iota(own_order.begin(), own_order.end(), 0u);
    order = own_order;
  } else if (order.size() != batch.rays.size()) {
    own_order = direction_order(batch.rays, executor);
    order = own_order;
  }
  std::vector<KernelHit> found(batch.rays.size());
  executor.parallel_for(order.size(), kChunk, [&](std::size_t begin, std::size_t end) {
    const std::span part(order.data() + begin, end - begin);
    const std::uint64_t overflows = trace_part(job, part, found);
    if (overflows > 0) overflows_ += overflows;
    for (const std::uint32_t i : part) job.hits[i] = hit_of(found[i]);
  });
  render_bodies(batch, job.hits, executor);
}

Hit BeamRenderer::trace(const Ray& ray) const {
  constexpr std::array<std::uint32_t, 1> kOrder = {0};
  std::array<KernelHit, 1> found;
  overflows_ += trace_beams(kernel_map_, {&ray, 1}, kOrder, found);
  return hit_of(found[0]);
}

Hit BeamRenderer::hit_of(const KernelHit& found) const {
  Hit hit;
  if (found.range < 0.0f) return hit;
  hit.range = found.range;
  hit.cos_incidence = found.cos_incidence;
  hit.intensity = map_->intensity(found.strongest);
  hit.surfel = found.strongest;
  return hit;
}

}  // namespace pointflight
