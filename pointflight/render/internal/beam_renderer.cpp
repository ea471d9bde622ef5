#include "pointflight/render/internal/beam_renderer.hpp"

#include <algorithm>
#include <array>
#include <limits>
#include <memory>
#include <vector>

#include "pointflight/core/argument.hpp"
#include "pointflight/render/internal/body_renderer.hpp"
#include "pointflight/render/internal/cone_kernel.hpp"
#include "pointflight/render/internal/direction_order.hpp"
#include "pointflight/render/internal/expanded_job.hpp"
#include "pointflight/render/internal/sub_ray_renderer.hpp"

namespace pointflight {
namespace {

constexpr std::size_t kChunk = 1024;   // rays
constexpr std::size_t kFewBeams = 64;  // of those that a device left
constexpr float kApart = 0.3f;         // m between what a beam ends at and a body behind it

const SurfelMap& map_of(const Scene& scene) {
  require_argument(scene.map != nullptr, "BeamRenderer: the scene has no map");
  return *scene.map;
}

/// The order in which a batch's rays are traced; into `room` if it has none of its own.
std::span<const std::uint32_t> order_of(const RayBatch& batch,
                                        std::span<const MapRay> rays,
                                        std::vector<std::uint32_t>& room,
                                        const Executor& executor) {
  if (batch.order.size() == rays.size()) return batch.order;
  room = direction_order(rays, executor);
  return room;
}

/// The echoes of beams that bodies cover, by eight rays against bodies alone; where the map covers
/// the bodies its echoes stand. `beams` are numbers of the job's rays; those in which both are seen
/// are returned.
std::vector<std::uint32_t> hide_behind_bodies(const RenderJob& job,
                                              std::span<const std::uint32_t> beams,
                                              const Executor& executor) {
  const WideBeams& wide = *job.wide;
  const std::vector<SubRay> eight = rim_of_eight();
  const auto met = [](const Hit& hit) { return hit.is_return(); };
  std::vector<std::uint8_t> is_mixed(beams.size(), 0);
  const auto receive = [&](std::size_t k, std::span<const Hit> hits) {
    if (std::none_of(hits.begin(), hits.end(), met)) return;
    Echoes& echoes = wide.echoes[beams[k]];
    float nearest = std::numeric_limits<float>::infinity();  // of the map
    float farthest = 0.0f;
    for (const Echo& echo : echoes.span()) {
      nearest = std::min(nearest, echo.range - echo.depth);
      farthest = std::max(farthest, echo.range + echo.depth);
    }
    const auto behind = [&](const Hit& hit) { return !met(hit) || hit.range > farthest + kApart; };
    const bool knows_all = echoes.all_hit && echoes.count < Echoes::kMost;
    if (knows_all && std::all_of(hits.begin(), hits.end(), behind)) return;
    const auto in_front = [&](const Hit& hit) { return met(hit) && hit.range < nearest; };
    if (std::all_of(hits.begin(), hits.end(), in_front)) {
      echoes = echoes_of_hits(wide, eight, hits);
    } else {
      is_mixed[k] = 1;
    }
  };
  const auto render = [&](const RenderJob& lines) {
    render_bodies(lines.batch, lines.hits, executor);
  };
  render_sub_rays(job, beams, eight, render, receive, executor);
  std::vector<std::uint32_t> mixed;
  for (std::size_t k = 0; k < beams.size(); ++k) {
    if (is_mixed[k] != 0) mixed.push_back(beams[k]);
  }
  return mixed;
}

}  // namespace

BeamRenderer::BeamRenderer(const Scene& scene, BeamGrouping grouping)
    : map_(scene.map), kernel_map_(kernel_map_of(map_of(scene))), grouping_(grouping) {}

void BeamRenderer::render_one(const RenderJob& job, const Executor& executor) const {
  if (!job.batch.bodies.empty() && (job.batch.aimed != nullptr || !job.ranges.empty())) {
    render_among_bodies(job, executor);
    return;
  }
  const std::vector<MapRay> rays = map_rays(kernel_map_, job.batch, executor);
  trace(job, rays, executor);
  render_bodies(job.batch, job.hits, executor);
}

/// The map by the beams themselves, bodies by the rays that are made of them.
void BeamRenderer::render_among_bodies(const RenderJob& job, const Executor& executor) const {
  const ExpandedJob expanded(job, executor);
  RenderJob map_alone = job;
  map_alone.hits = expanded.job().hits;
  map_alone.ranges = {};
  trace(map_alone, map_rays(kernel_map_, job.batch, executor), executor);
  render_bodies(expanded.job().batch, expanded.job().hits, executor);
  expanded.finish();
}

/// What rays hit of the map.
void BeamRenderer::trace(const RenderJob& job,
                         std::span<const MapRay> rays,
                         const Executor& executor) const {
  std::vector<std::uint32_t> room;
  const std::span<const std::uint32_t> order = order_of(job.batch, rays, room, executor);
  std::vector<KernelHit> found(rays.size());
  executor.parallel_for(order.size(), kChunk, [&](std::size_t begin, std::size_t end) {
    const std::span part = order.subspan(begin, end - begin);
    const std::uint64_t overflows = trace_beams(kernel_map_, rays, part, found, grouping_);
    if (overflows > 0) overflows_ += overflows;
    if (job.ranges.empty()) {
      for (const std::uint32_t i : part) job.hits[i] = hit_of(found[i]);
    } else {
      for (const std::uint32_t i : part) job.ranges[i] = found[i].range;
    }
  });
}

bool BeamRenderer::are_cones(const WideBeams& wide) {
  const float widest = kSubRayRadius * std::max(wide.sigma_across, wide.sigma_up);
  return wide.sub_rays == 0 && widest <= kWidestCone;
}

/// Through the map as cones; those that bodies may touch by sub-rays.
void BeamRenderer::render_wide(const RenderJob& job, const Executor& executor) const {
  if (!are_cones(*job.wide)) {
    Renderer::render_wide(ExpandedJob(job, executor).job(), executor);
    return;
  }
  const bool wants_rays = !job.batch.bodies.empty();
  const ExpandedJob expanded(job, executor, wants_rays ? Expand::kAll : Expand::kAcross);
  const std::vector<MapRay> rays = map_rays(kernel_map_, job.batch, executor);
  std::vector<std::uint32_t> room;
  const std::span<const std::uint32_t> order = order_of(job.batch, rays, room, executor);
  executor.parallel_for(order.size(), kChunk, [&](std::size_t begin, std::size_t end) {
    const std::span part = order.subspan(begin, end - begin);
    trace_cones(*map_, kernel_map_, rays, part, *expanded.job().wide);
  });
  if (wants_rays) hide_echoes(expanded.job(), executor);
}

/// Behind bodies: of a job whose rays are there.
void BeamRenderer::hide_echoes(const RenderJob& job, const Executor& executor) const {
  const WideBeams& wide = *job.wide;
  const float widest = kSubRayRadius * std::max(wide.sigma_across, wide.sigma_up);
  const std::vector<std::uint32_t> near = rays_near_bodies(job.batch, widest, executor);
  const std::vector<std::uint32_t> mixed = hide_behind_bodies(job, near, executor);
  const auto render_lines = [&](const RenderJob& lines) { render_one(lines, executor); };
  find_echoes(job, mixed, kUsualSubRays, render_lines, executor);
}

void BeamRenderer::finish_cones(const RenderJob& job,
                                std::span<const std::uint32_t> beams,
                                const Executor& executor) const {
  if (!beams.empty()) {
    // by their numbers, which turn their sub-rays
    const auto rays = std::make_unique_for_overwrite<MapRay[]>(job.batch.size());
    const auto across = std::make_unique_for_overwrite<Vector3f[]>(job.batch.size());
    WideBeams wide = *job.wide;
    wide.across = {across.get(), job.batch.size()};
    executor.parallel_for(beams.size(), kFewBeams, [&](std::size_t begin, std::size_t end) {
      const std::span part = beams.subspan(begin, end - begin);
      for (const std::uint32_t i : part) {
        rays[i] = map_ray(kernel_map_, job.batch, i);
        make_across(*job.batch.aimed, i, {&across[i], 1});
      }
      trace_cones(*map_, kernel_map_, {rays.get(), job.batch.size()}, part, wide);
    });
  }
  if (!job.batch.bodies.empty()) hide_echoes(ExpandedJob(job, executor).job(), executor);
}

Hit BeamRenderer::trace(const Ray& ray) const {
  return trace(map_ray(kernel_map_, ray));
}

Hit BeamRenderer::trace(const MapRay& ray) const {
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
