#include "pointflight/render/internal/sub_ray_renderer.hpp"

#include <algorithm>

namespace pointflight {
namespace {

constexpr std::size_t kRaysAtOnce = 16384;
constexpr std::size_t kBeamsPerChunk = 256;
constexpr std::size_t kFewest = 8;  // sub-rays: with fewer, edges are missed

/// The sub-rays of one beam in the world.
void aim(const WideBeams& wide,
         const Ray& middle,
         std::size_t beam,
         const std::vector<SubRay>& sub_rays,
         std::span<Ray> rays) {
  const Vector3f across = wide.across[beam];
  const Vector3f up = middle.direction_world.cross(across);
  const auto [c, s] = turn_of(beam);
  for (std::size_t i = 0; i < sub_rays.size(); ++i) {
    const float x = wide.sigma_across * (c * sub_rays[i].x - s * sub_rays[i].y);
    const float y = wide.sigma_up * (s * sub_rays[i].x + c * sub_rays[i].y);
    rays[i] = middle;
    rays[i].direction_world = (middle.direction_world + x * across + y * up).normalized();
  }
}

}  // namespace

Echoes echoes_of_hits(const WideBeams& wide,
                      const std::vector<SubRay>& sub_rays,
                      std::span<const Hit> hits) {
  std::vector<BeamPart> parts(hits.size());
  for (std::size_t i = 0; i < hits.size(); ++i) {
    const Hit& hit = hits[i];
    parts[i].share = sub_rays[i].share;
    if (!hit.is_return()) continue;
    parts[i] = {.range = hit.range,
                .share = sub_rays[i].share,
                .reflectivity = static_cast<float>(wide.receiver->reflectivity(hit)),
                .intensity = hit.intensity,
                .label = hit.label,
                .origin = {hit.cos_incidence, hit.surfel, static_cast<std::uint16_t>(i)}};
  }
  return echoes_of(parts, wide.merge);
}

void render_sub_rays(const RenderJob& job,
                     std::span<const std::uint32_t> beams,
                     const std::vector<SubRay>& sub_rays,
                     const std::function<void(const RenderJob& lines)>& render,
                     const std::function<void(std::size_t k, std::span<const Hit>)>& receive,
                     const Executor& executor) {
  const std::size_t n = sub_rays.size();
  const std::size_t at_once = std::max<std::size_t>(1, kRaysAtOnce / n);
  std::vector<Ray> rays;
  std::vector<Duration> offsets;
  std::vector<Hit> hits;
  for (std::size_t from = 0; from < beams.size(); from += at_once) {
    const std::span some = beams.subspan(from, std::min(at_once, beams.size() - from));
    rays.resize(some.size() * n);
    hits.assign(rays.size(), {});
    offsets.resize(job.batch.time_offsets.empty() ? 0 : rays.size());
    executor.parallel_for(some.size(), kBeamsPerChunk, [&](std::size_t begin, std::size_t end) {
      for (std::size_t b = begin; b < end; ++b) {
        const Ray& middle = job.batch.rays[some[b]];
        aim(*job.wide, middle, some[b], sub_rays, std::span(rays).subspan(b * n, n));
        if (offsets.empty()) continue;
        std::fill_n(&offsets[b * n], n, job.batch.time_offsets[some[b]]);
      }
    });
    RenderJob lines{job.batch, hits, std::nullopt};
    lines.batch.rays = rays;
    lines.batch.aimed = nullptr;
    lines.batch.order = {};
    lines.batch.time_offsets = offsets;
    render(lines);
    executor.parallel_for(some.size(), kBeamsPerChunk, [&](std::size_t begin, std::size_t end) {
      for (std::size_t b = begin; b < end; ++b) {
        receive(from + b, std::span<const Hit>(hits).subspan(b * n, n));
      }
    });
  }
}

void find_echoes(const RenderJob& job,
                 std::span<const std::uint32_t> beams,
                 std::size_t count,
                 const std::function<void(const RenderJob& lines)>& render,
                 const Executor& executor) {
  const std::vector<SubRay> sub_rays =
      count <= kFewest ? rim_of_eight() : spread_sub_rays((count + 7) / 8 * 8);
  const auto receive = [&](std::size_t k, std::span<const Hit> hits) {
    job.wide->echoes[beams[k]] = echoes_of_hits(*job.wide, sub_rays, hits);
  };
  render_sub_rays(job, beams, sub_rays, render, receive, executor);
}

}  // namespace pointflight
