#include "pointflight/survey/opacity_fit.hpp"

#include <algorithm>
#include <atomic>
#include <memory>
#include <vector>

#include "pointflight/map/map_file.hpp"
#include "pointflight/survey/survey_hits.hpp"

namespace pointflight {
namespace {

/// Counts of a surfel's rays.
struct RayCounts {
  std::atomic<std::uint32_t> returned{0};
  std::atomic<std::uint32_t> passed{0};
};

/// The surface that a ray is rendered at, from a hit on.
struct RenderedSurface {
  std::uint32_t word = 0;  ///< Of the surfel that gives most of it.
  float range = -1.0f;     ///< m; negative: there is none.
};

/// The hit rule on hits sorted by range, from number `from` on.
RenderedSurface next_surface(std::span<const SurfelHit> hits,
                             std::size_t from,
                             const KernelMap& kernel) {
  for (std::size_t first = from; first < hits.size(); ++first) {
    std::int64_t covered = 0;
    double weighted = 0.0;
    RenderedSurface surface;
    std::int32_t strongest = 0;
    for (std::size_t i = first; i < hits.size() && hits[i].t <= hits[first].t + kernel.window;
         ++i) {
      const SurfelHit& hit = hits[i];
      covered += hit.weight;
      weighted += static_cast<double>(hit.weight) * static_cast<double>(hit.t);
      if (hit.weight <= strongest) continue;
      strongest = hit.weight;
      surface.word = hit.word;
    }
    if (covered < kernel.tau || covered <= 0) continue;
    surface.range = static_cast<float>(weighted / static_cast<double>(covered));
    return surface;
  }
  return {};
}

/// Counts what one ray says of all the surfaces on its way.
void count_ray(const SurveyRay& ray,
               std::vector<SurfelHit> hits,
               const KernelMap& kernel,
               float right,
               RayCounts* counts) {
  std::sort(hits.begin(), hits.end(), [](const SurfelHit& a, const SurfelHit& b) {
    return a.t != b.t ? a.t < b.t : a.word < b.word;
  });
  const float end = ray.is_return ? ray.range - right : ray.range;
  std::size_t from = 0;
  while (true) {
    const RenderedSurface surface = next_surface(hits, from, kernel);
    if (surface.range < 0.0f) return;
    RayCounts& count = counts[surface.word];
    if (surface.range >= end) {
      const bool is_own = ray.is_return && surface.range <= ray.range + right;
      if (is_own) count.returned.fetch_add(1, std::memory_order_relaxed);
      return;
    }
    count.passed.fetch_add(1, std::memory_order_relaxed);
    while (from < hits.size() && hits[from].t < surface.range + kernel.r) ++from;
  }
}

}  // namespace

std::uint64_t fit_opacity(EditedMap& map,
                          const SurveyOpener& survey,
                          const OpacityOptions& options,
                          const Executor& executor,
                          const Progress& progress) {
  const auto fitted = SurfelMap::from_bytes(map_bytes(map.tree, map.description), "the fitted map");
  const KernelMap kernel = kernel_map_of(*fitted);
  const std::size_t words = fitted->words().size();
  const std::unique_ptr<RayCounts[]> counts(new RayCounts[words]);
  const auto right = static_cast<float>(options.right);
  follow_survey(*fitted,
                survey,
                options.right,
                executor,
                "counting rays that go through",
                progress,
                [&](const SurveyRay& ray, const RayHits& way) {
                  count_ray(ray, {way.hits.begin(), way.hits.end()}, kernel, right, counts.get());
                });
  std::vector<SurfelNote> notes(words);
  std::uint64_t clear = 0;
  for (std::size_t word = 0; word < words; ++word) {
    notes[word] = fitted->notes().of(static_cast<std::uint32_t>(word));
    const double returned = counts[word].returned.load();
    const double rays = returned + counts[word].passed.load();
    const double share = (returned + 1.0) / (rays + 1.0);
    if (notes[word].is_assumed || rays < options.rays_min || share > options.share_max) continue;
    notes[word].opacity = Opacity::of_share(share);
    ++clear;
  }
  set_notes(map.description, notes);
  return clear;
}

}  // namespace pointflight
