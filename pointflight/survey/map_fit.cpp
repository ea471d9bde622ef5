#include "pointflight/survey/map_fit.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <utility>

#include "pointflight/core/constants.hpp"
#include "pointflight/core/math.hpp"
#include "pointflight/map/known_space.hpp"
#include "pointflight/map/map_file.hpp"
#include "pointflight/survey/surfel_changes.hpp"
#include "pointflight/survey/surfel_evidence.hpp"
#include "pointflight/survey/survey_hits.hpp"

namespace pointflight {
namespace {

constexpr SurfelWord kPlaceBits = (SurfelWord{1} << 30) - 1;
constexpr float kWidest = 1.8f;           // r: what eight bytes can say
constexpr float kThinnestVolume = 0.06f;  // r: above the planar class
constexpr double kLeastShare = 1e-3;

/// How a ray of the survey is rendered.
enum class Fate : std::uint8_t { kEarly, kLeak, kRight, kFree };

Fate fate_of(const SurveyRay& ray, float rendered, float right) {
  if (!ray.is_return) return rendered < 0.0f ? Fate::kFree : Fate::kEarly;
  if (rendered < 0.0f || rendered > ray.range + right) return Fate::kLeak;
  return rendered < ray.range - right ? Fate::kEarly : Fate::kRight;
}

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

/// A surfel with its standard deviations scaled, its position as it was.
SurfelWord resized(SurfelWord word, const std::array<double, 3>& factors) {
  if (factors == std::array{1.0, 1.0, 1.0}) return word;  // encoding would round the axes
  Surfel surfel = decode(word);
  for (int k = 0; k < 3; ++k) {
    surfel.s[k] *= static_cast<float>(factors[static_cast<std::size_t>(k)]);
  }
  if (surfel.s[1] > surfel.s[2]) {
    std::swap(surfel.s[1], surfel.s[2]);
    const Vector3f axis = surfel.axes.col(1);
    surfel.axes.col(1) = surfel.axes.col(2);
    surfel.axes.col(2) = axis;
  }
  for (const int k : {1, 2}) surfel.s[k] = std::clamp(surfel.s[k], kMinSpread, kWidest);
  surfel.s[0] =
      is_planar(word) ? kPlanarThickness : std::clamp(surfel.s[0], kThinnestVolume, surfel.s[1]);
  surfel.center_voxels = Vector3f::Constant(0.5f);  // any: the old position is put back
  return (encode(surfel) & ~kPlaceBits) | (word & kPlaceBits);
}

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
    return resized(word, {factor, factor, factor});
  };
  return changed(map, change, options, executor);
}

// ---- pass 2

/// d w / d(ln s_k) of a hit's weight: w = c (1 - q / M^2)^2 with q = sum a_k^2, a_k the coordinates
/// of the nearest point in units of s_k, and c = 36 / (pi M^2), so 4 c (1 - q / M^2) a_k^2 / M^2.
class WeightSlopes {
 public:
  explicit WeightSlopes(const SurfelMap& map)
      : map_(map),
        support_squared_(static_cast<double>(map.model().support) *
                         static_cast<double>(map.model().support)),
        headers_(map.words().size(), 0) {
    for_each_surfel(map.words(), [&](const LeafHeader&, std::size_t word) {
      headers_[word] = static_cast<std::uint8_t>(headers_[word - 1] + 1);
    });
  }

  [[nodiscard]] std::array<double, 3> at(const SurveyRay& ray, const SurfelHit& met) const {
    const Surfel surfel = decode(map_.words()[met.word]);
    const LeafHeader leaf = decode_leaf(map_.words()[met.word - headers_[met.word]]);
    const Vector3d nearest = ray.origin_world +
                             static_cast<double>(met.t) * ray.direction_world.cast<double>() -
                             map_.center_world(leaf, map_.words()[met.word]);
    std::array<double, 3> squares{};
    double q = 0.0;
    for (int k = 0; k < 3; ++k) {
      const double a = surfel.axes.col(k).cast<double>().dot(nearest) /
                       (map_.resolution() * static_cast<double>(surfel.s[k]));
      squares[static_cast<std::size_t>(k)] = a * a;
      q += a * a;
    }
    const double inside = std::max(0.0, 1.0 - q / support_squared_);
    const double scale = 4.0 * 36.0 / (kPi * support_squared_) * inside / support_squared_;
    return {scale * squares[0], scale * squares[1], scale * squares[2]};
  }

 private:
  const SurfelMap& map_;
  double support_squared_;
  std::vector<std::uint8_t> headers_;  ///< Of each word, how far back its leaf's header lies.
};

/// Kinds of evidence: for each axis and fate, and early rays as such.
constexpr std::size_t kind_of(std::size_t axis, Fate fate) {
  return 3 * axis + static_cast<std::size_t>(fate);
}
constexpr std::size_t kEarlyRays = 9;
constexpr std::size_t kBlameKinds = 10;

/// New sizes of one surfel, or nothing if it is to go.
std::optional<std::array<double, 3>> factors_of(const SurfelEvidence& evidence,
                                                std::size_t word,
                                                const FitOptions& fit) {
  std::array<double, 3> factors{};
  double early_all = 0.0;
  double all = 0.0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double early = evidence.sum(word, kind_of(axis, Fate::kEarly));
    const double leaks = evidence.sum(word, kind_of(axis, Fate::kLeak));
    const double right = evidence.sum(word, kind_of(axis, Fate::kRight));
    const double change = -fit.step * (early - fit.leak_weight * leaks) /
                          (early + fit.leak_weight * leaks + right + fit.doubt);
    factors[axis] = std::min(fit.growth_max, math::exp(change));
    early_all += early;
    all += early + leaks + right;
  }
  if (evidence.sum(word, kEarlyRays) >= 3.0 && early_all >= fit.blame_share * all) {
    return std::nullopt;
  }
  return factors;
}

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
  SurfelEvidence evidence(map.words().size(), kBlameKinds);
  FateCounts fates;
  const WeightSlopes slopes(map);
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
    for (const SurfelHit& met : way.hits) {
      const bool is_concerned = fate == Fate::kLeak
                                    ? std::abs(met.t - ray.range) <= right
                                    : met.t >= way.first && met.t <= way.first + window;
      if (!is_concerned || met.weight <= 0) continue;
      const auto slope = slopes.at(ray, met);
      for (std::size_t axis = 0; axis < 3; ++axis) {
        evidence.add(met.word, kind_of(axis, fate), slope[axis]);
      }
      if (fate == Fate::kEarly) evidence.add(met.word, kEarlyRays, 1.0);
    }
  };
  report.overflows += follow_survey(
      map, survey, fit.right, executor, "fitting sizes to rendered rays", progress, visit);
  before = fates.rays();
  const auto change = [&](const LeafHeader&, std::size_t at) -> std::optional<SurfelWord> {
    if (map.is_assumed(static_cast<std::uint32_t>(at))) return map.words()[at];
    const auto factors = factors_of(evidence, at, fit);
    if (factors) return resized(map.words()[at], *factors);
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
  for (int pass = 0; pass < fit.blame_passes; ++pass) {
    const auto before =
        SurfelMap::from_bytes(map_bytes(fitted.tree, fitted.description), "the map half fitted");
    fitted = {};  // room for the next
    OwnRays rays;
    KnownSpaceBuilder* marks = known && pass == 0 ? &*known : nullptr;
    fitted =
        correct_by_blame(*before, survey, fit, marks, rays, options, executor, report, progress);
    if (pass == 0) report.between = rays;
  }
  fitted.surfels_before = map.surfel_count();
  if (known) {
    if (const KnownSpace* old = map.known_space()) {
      known->add([&](const Vector3d& center) { return old->known(center); });
    }
    set_section(fitted.description, KnownSpace::kSection, known->section());
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
