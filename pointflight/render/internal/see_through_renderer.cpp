#include "pointflight/render/internal/see_through_renderer.hpp"

#include <algorithm>
#include <numeric>
#include <utility>
#include <vector>

#include "pointflight/core/random.hpp"
#include "pointflight/render/internal/beam_renderer.hpp"

namespace pointflight {
namespace {

/// Draws of a beam: one for each echo that the renderer in front has found, then one for each hit
/// behind. What lies behind the last is not there.
constexpr std::uint32_t kDrawsInFront = Echoes::kMost;
constexpr std::uint32_t kDraws = 16;

/// One beam on its way.
struct BeamOnItsWay {
  std::uint32_t number;
  float passed;  ///< m from its origin to where it goes on.
};

/// Of one job: which beams go on, and what they find.
class ThroughJob {
 public:
  ThroughJob(const RenderJob& job, const SurfelMap& map, const Renderer& behind)
      : job_(job), map_(map), behind_(behind) {}

  /// Changes the job's hits or echoes to what comes back.
  void go_on(const Executor& executor) {
    std::vector<BeamOnItsWay> beams;
    const auto order = job_.batch.order;
    for (std::size_t i = 0; i < job_.batch.size(); ++i) {
      const auto number = order.empty() ? static_cast<std::uint32_t>(i) : order[i];
      const auto passed = job_.wide ? after_echoes(number) : after_hit(number);
      if (passed) beams.push_back({number, *passed});
    }
    for (std::uint32_t draw = kDrawsInFront; draw < kDraws && !beams.empty(); ++draw) {
      const std::vector<Hit> hits = hits_behind(beams, executor);
      std::vector<BeamOnItsWay> further;
      for (std::size_t i = 0; i < beams.size(); ++i) {
        if (!hits[i].is_return()) continue;
        const std::uint32_t number = beams[i].number;
        const Opacity::Fate fate = fate_of(number, draw, hits[i].surfel, hits[i].cos_incidence);
        if (fate == Opacity::Fate::kReturns) take(number, hits[i]);
        if (fate == Opacity::Fate::kPasses) further.push_back({number, hits[i].range + step()});
      }
      beams.swap(further);
    }
  }

 private:
  [[nodiscard]] Ray ray_behind(const BeamOnItsWay& beam) const {
    Ray ray;
    if (job_.batch.aimed == nullptr) {
      ray = job_.batch.rays[beam.number];
    } else {
      make_rays(*job_.batch.aimed, beam.number, {&ray, 1});
    }
    ray.origin_world += static_cast<double>(beam.passed) * ray.direction_world.cast<double>();
    ray.range_max = std::max(0.0f, std::min(ray.range_max, job_.batch.range_max) - beam.passed);
    return ray;
  }

  /// With ranges from the beams' origins.
  [[nodiscard]] std::vector<Hit> hits_behind(std::span<const BeamOnItsWay> beams,
                                             const Executor& executor) const {
    std::vector<Ray> rays;
    std::vector<Duration> offsets;
    for (const BeamOnItsWay& beam : beams) {
      rays.push_back(ray_behind(beam));
      if (!job_.batch.time_offsets.empty()) {
        offsets.push_back(job_.batch.time_offsets[beam.number]);
      }
    }
    RayBatch batch = job_.batch;
    batch.aimed = nullptr;
    batch.rays = rays;
    // they are in the order of the job's
    std::vector<std::uint32_t> order(rays.size());
    std::iota(order.begin(), order.end(), 0u);
    batch.order = order;
    batch.time_offsets = offsets;
    std::vector<Hit> hits(rays.size());
    behind_.render(batch, hits, executor);
    for (std::size_t i = 0; i < hits.size(); ++i) {
      if (hits[i].is_return()) hits[i].range += beams[i].passed;
    }
    return hits;
  }

  [[nodiscard]] Opacity::Fate fate_of(std::uint32_t number,
                                      std::uint32_t draw,
                                      std::uint32_t surfel,
                                      float cos_incidence) const {
    const std::uint8_t opacity = map_.notes().opacity(surfel);
    if (opacity == Opacity::kOpaque) return Opacity::Fate::kReturns;
    const BeamDraws& draws = job_.batch.draws;
    const RandomStream random(draws.seed, StreamId::kSeeThrough, draw << 28 | draws.entity);
    return Opacity::fate(opacity, cos_incidence, random.uniform(draws.scan << 32 | number));
  }

  /// How far behind a surfel the next one may be: not one of the same sheet.
  [[nodiscard]] float step() const { return static_cast<float>(map_.resolution()); }

  /// Renderers of images do not say what they hit: what is nearest.
  [[nodiscard]] std::uint32_t surfel_of(std::uint32_t number, const Hit& hit) const {
    if (hit.surfel != kNoSurfel || hit.label != kMapLabel) return hit.surfel;
    const Ray ray = ray_behind({number, hit.range});
    const auto nearest = map_.nearest(ray.origin_world, map_.resolution());
    return nearest ? nearest->word : kNoSurfel;
  }

  /// Where a beam goes on, if it does; then its hit is taken away, as if it is lost.
  std::optional<float> after_hit(std::uint32_t number) {
    Hit& hit = job_.hits[number];
    if (!hit.is_return()) return std::nullopt;
    const Opacity::Fate fate = fate_of(number, 0, surfel_of(number, hit), hit.cos_incidence);
    if (fate == Opacity::Fate::kReturns) return std::nullopt;
    const float range = hit.range;
    hit = {};
    if (fate == Opacity::Fate::kLost) return std::nullopt;
    return range + step();
  }

  /// The same of a wide beam, if none of it has found something behind already.
  std::optional<float> after_echoes(std::uint32_t number) {
    Echoes& echoes = job_.wide->echoes[number];
    Echoes kept;
    kept.all_hit = echoes.all_hit;
    std::optional<float> passed;
    for (std::uint32_t k = 0; k < echoes.count; ++k) {
      const Echo& echo = echoes.all[k];
      const Opacity::Fate fate = fate_of(number, k, echo.origin.surfel, echo.origin.cos_incidence);
      if (fate == Opacity::Fate::kReturns) {
        kept.all[kept.count++] = echo;
        passed.reset();
        continue;
      }
      kept.all_hit = false;
      if (fate == Opacity::Fate::kPasses) passed = echo.range + step();
    }
    echoes = kept;
    return passed;
  }

  void take(std::uint32_t number, const Hit& hit) {
    if (!job_.wide) {
      job_.hits[number] = hit;
      return;
    }
    Echo echo;
    echo.range = hit.range;
    echo.reflectivity = static_cast<float>(job_.wide->receiver->reflectivity(hit));
    echo.intensity = hit.intensity;
    echo.label = hit.label;
    echo.parts = 1;
    echo.origin = {hit.cos_incidence, hit.surfel, 0};
    add_echo(echo, job_.wide->echoes[number]);
  }

  RenderJob job_;
  const SurfelMap& map_;
  const Renderer& behind_;
};

}  // namespace

class SeeThroughRenderer::Through : public Rendering {
 public:
  Through(std::span<const RenderJob> jobs,
          const SeeThroughRenderer& renderer,
          const Executor& executor)
      : renderer_(renderer),
        executor_(executor),
        jobs_(jobs.begin(), jobs.end()),
        hits_(jobs.size()) {
    for (std::size_t k = 0; k < jobs_.size(); ++k) {
      if (jobs_[k].ranges.empty()) continue;
      // which surfel it is has to be known
      hits_[k].resize(jobs_[k].ranges.size());
      jobs_[k].hits = hits_[k];
      jobs_[k].ranges = {};
    }
    ranges_.reserve(jobs.size());
    for (const RenderJob& job : jobs) ranges_.push_back(job.ranges);
    front_ = renderer.front_->submit(jobs_, executor);
  }

  void collect() override {
    front_->collect();
    executor_.parallel_for(jobs_.size(), 1, [&](std::size_t k, std::size_t) {
      CpuAccount* const account = jobs_[k].account;
      const ChargeTo charge(account != nullptr ? account : ChargeTo::current());
      ThroughJob(jobs_[k], *renderer_.map_, *renderer_.behind_).go_on(executor_);
      for (std::size_t i = 0; i < hits_[k].size(); ++i) ranges_[k][i] = hits_[k][i].range;
    });
  }

 private:
  const SeeThroughRenderer& renderer_;
  const Executor& executor_;
  std::vector<RenderJob> jobs_;
  std::vector<std::vector<Hit>> hits_;    // of jobs that ask for ranges
  std::vector<std::span<float>> ranges_;  // that they ask for
  std::unique_ptr<Rendering> front_;
};

SeeThroughRenderer::SeeThroughRenderer(std::unique_ptr<Renderer> front, const Scene& scene)
    // each ray starts somewhere else: neighbours have no way in common
    : front_(std::move(front)),
      behind_(std::make_unique<BeamRenderer>(scene, BeamGrouping::kSingly)),
      map_(scene.map) {}

std::unique_ptr<Rendering> SeeThroughRenderer::submit(std::span<const RenderJob> jobs,
                                                      const Executor& executor) const {
  return std::make_unique<Through>(jobs, *this, executor);
}

Hit SeeThroughRenderer::trace(const Ray& ray) const {
  const Hit hit = front_->trace(ray);
  return map_->notes().opacity(hit.surfel) == Opacity::kOpaque ? hit : Renderer::trace(ray);
}

void SeeThroughRenderer::render_one(const RenderJob& job, const Executor& executor) const {
  submit({&job, 1}, executor)->collect();
}

}  // namespace pointflight
