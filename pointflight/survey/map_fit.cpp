#include "pointflight/survey/map_fit.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <functional>
#include <memory>
#include <optional>
#include <utility>

#include "pointflight/core/math.hpp"
#include "pointflight/map/known_space.hpp"
#include "pointflight/map/map_file.hpp"
#include "pointflight/survey/internal/ray_fate.hpp"
#include "pointflight/survey/internal/reshaped_surfel.hpp"
#include "pointflight/survey/internal/surfel_blame.hpp"
#include "pointflight/survey/opacity_fit.hpp"
#include "pointflight/survey/surfel_changes.hpp"
#include "pointflight/survey/surfel_evidence.hpp"
#include "pointflight/survey/survey_hits.hpp"

namespace pointflight {
namespace {

constexpr double kLeastShare = 1e-3;

/// Counts of fates, from several threads.
class FateCounts {
 public:
  void add(const SurveyRay& ray, Fate fate) {
    at(ray.is_return, fate).fetch_add(1, std::memory_order_relaxed);
  }
  [[nodiscard]] OwnRays rays() const {
    OwnRays own;
    own.right = count(true, Fate::kRight);
    own.early = count(true, Fate::kEarly);
    own.leaks = count(true, Fate::kLeak);
    own.returns = own.right + own.early + own.leaks;
    own.stopped = count(false, Fate::kEarly);
    own.empty = own.stopped + count(false, Fate::kFree);
    return own;
  }

 private:
  [[nodiscard]] std::atomic<std::uint64_t>& at(bool is_return, Fate fate) {
    return counts_[4 * (is_return ? 1 : 0) + static_cast<std::size_t>(fate)];
  }
  [[nodiscard]] std::uint64_t count(bool is_return, Fate fate) const {
    return counts_[4 * (is_return ? 1 : 0) + static_cast<std::size_t>(fate)];
  }

  std::array<std::atomic<std::uint64_t>, 8> counts_{};
};

// ---- pass 1

constexpr std::size_t kPassed = 0;
constexpr std::size_t kHit = 1;

EditedMap shrink_by_passes(const SurfelMap& map,
                           const SurveyOpener& survey,
                           const FitOptions& fit,
                           const EditOptions& options,
                           const Executor& executor,
                           FitReport& report,
                           const Progress& progress) {
  SurfelEvidence evidence(map.words().size(), 2);
  FateCounts fates;
  const auto right = static_cast<float>(fit.right);
  const auto visit = [&](const SurveyRay& ray, const RayHits& way) {
    fates.add(ray, fate_of(ray, way.range, right));
    for (const SurfelHit& met : way.hits) {
      if (!ray.is_return || met.t < ray.range - right) {
        evidence.add(met.word, kPassed, met.weight);
      } else if (met.t <= ray.range + right) {
        evidence.add(met.word, kHit, met.weight);
      }
    }
  };
  report.overflows += follow_survey(
      map, survey, fit.right, executor, "fitting sizes to free rays", progress, visit);
  report.before = fates.rays();
  report.rays = report.before.returns + report.before.empty;
  const auto change = [&](const LeafHeader& leaf, std::size_t at) -> std::optional<SurfelWord> {
    const SurfelWord word = map.words()[at];
    if (map.is_assumed(static_cast<std::uint32_t>(at))) return word;  // judged when it was made
    const double passes = evidence.sum(at, kPassed);
    const double hits = evidence.sum(at, kHit);
    if (passes + hits <= 0.0) {
      ++report.unseen;
      return word;
    }
    const double share = hits / (hits + passes);
    if (share < fit.ghost_share && passes >= fit.ghost_passes) {
      report.ghosts.push_back(map.center_world(leaf, word));
      return std::nullopt;
    }
    const double factor = math::pow(std::max(share, kLeastShare), fit.exponent);
    return reshaped(word, {.factors = {factor, factor, factor}});
  };
  return changed(map, change, options, executor);
}

// ---- pass 2

/// Reads a survey and keeps where its rays began.
class OriginKeeper : public SurveyReader {
 public:
  OriginKeeper(std::unique_ptr<SurveyReader> survey, Aabb& origins)
      : survey_(std::move(survey)), origins_(origins) {}

  bool read(std::vector<SurveyRay>& batch) override {
    const bool more = survey_->read(batch);
    for (const SurveyRay& ray : batch) origins_.add(ray.origin_world);
    return more;
  }
  [[nodiscard]] bool has_intensity() const override { return survey_->has_intensity(); }
  [[nodiscard]] double share_read() const override { return survey_->share_read(); }

 private:
  std::unique_ptr<SurveyReader> survey_;
  Aabb& origins_;
};

EditedMap correct_by_blame(const SurfelMap& map,
                           const SurveyOpener& survey,
                           const FitOptions& fit,
                           KnownSpaceBuilder* known,
                           OwnRays& before,
                           const EditOptions& options,
                           const Executor& executor,
                           FitReport& report,
                           const Progress& progress) {
  SurfelBlame blame(map, fit);
  FateCounts fates;
  const auto right = static_cast<float>(fit.right);
  const float window = kernel_map_of(map).window;
  const auto visit = [&](const SurveyRay& ray, const RayHits& way) {
    if (known != nullptr) {
      known->cross(
          ray.origin_world, ray.direction_world.cast<double>(), static_cast<double>(ray.range));
    }
    const Fate fate = fate_of(ray, way.range, right);
    fates.add(ray, fate);
    if (fate == Fate::kFree) return;
    for (const SurfelHit& hit : way.hits) {
      const bool is_concerned = fate == Fate::kLeak
                                    ? std::abs(hit.t - ray.range) <= right
                                    : hit.t >= way.first && hit.t <= way.first + window;
      if (!is_concerned || hit.weight <= 0) continue;
      blame.add(ray, fate, hit);
    }
  };
  report.overflows += follow_survey(
      map, survey, fit.right, executor, "fitting shapes to rendered rays", progress, visit);
  before = fates.rays();
  const auto change = [&](const LeafHeader&, std::size_t at) -> std::optional<SurfelWord> {
    if (map.is_assumed(static_cast<std::uint32_t>(at))) return map.words()[at];
    const auto verdict = blame.verdict(at);
    if (verdict) return reshaped(map.words()[at], *verdict);
    ++report.blamed;
    return std::nullopt;
  };
  return changed(map, change, options, executor);
}

}  // namespace

EditedMap fit_map(const SurfelMap& map,
                  const SurveyOpener& survey,
                  const FitOptions& fit,
                  const EditOptions& options,
                  const Executor& executor,
                  FitReport& report,
                  const Progress& progress) {
  report = {};
  Aabb box = map.bounds_world();
  const SurveyOpener kept = [&] { return std::make_unique<OriginKeeper>(survey(), box); };
  EditedMap fitted = shrink_by_passes(map, kept, fit, options, executor, report, progress);
  std::optional<KnownSpaceBuilder> known;
  if (fit.known_space) known.emplace(box, map.resolution(), fitted.surfels);
  FitOptions of_pass = fit;
  for (int pass = 0; pass < fit.blame_passes; ++pass) {
    const auto before =
        SurfelMap::from_bytes(map_bytes(fitted.tree, fitted.description), "the map half fitted");
    fitted = {};  // room for the next
    OwnRays rays;
    KnownSpaceBuilder* marks = known && pass == 0 ? &*known : nullptr;
    fitted = correct_by_blame(
        *before, survey, of_pass, marks, rays, options, executor, report, progress);
    of_pass.expected_leaks = 0.0;  // the next ones see what came of expecting them
    if (pass == 0) report.between = rays;
  }
  fitted.surfels_before = map.surfel_count();
  if (known) {
    if (const KnownSpace* old = map.known_space()) {
      known->add([&](const Vector3d& center) { return old->known(center); });
    }
    set_section(fitted.description, KnownSpace::kSection, known->section());
  }
  if (fit.opacity) {
    const OpacityOptions chosen{.right = fit.right};
    report.clear = fit_opacity(fitted, survey, chosen, executor, progress);
  }
  return fitted;
}

OwnRays measure_rays(const SurfelMap& map,
                     const SurveyOpener& survey,
                     double right,
                     const std::function<bool(const SurveyRay&)>& counts,
                     const Executor& executor,
                     const Progress& progress) {
  FateCounts fates;
  follow_survey(map,
                survey,
                right,
                executor,
                "rendering survey rays",
                progress,
                [&](const SurveyRay& ray, const RayHits& way) {
                  if (counts && !counts(ray)) return;
                  fates.add(ray, fate_of(ray, way.range, static_cast<float>(right)));
                });
  return fates.rays();
}

}  // namespace pointflight
