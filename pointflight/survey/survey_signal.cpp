#include "pointflight/survey/survey_signal.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "pointflight/core/input_error.hpp"
#include "pointflight/core/math.hpp"
#include "pointflight/core/scratch.hpp"
#include "pointflight/map/map_file.hpp"
#include "pointflight/survey/surfel_evidence.hpp"
#include "pointflight/survey/survey_hits.hpp"

namespace pointflight {
namespace {

constexpr double kWeakest = 0.01;         // share of returns below the limit
constexpr double kSeenAtLimit = 0.15;     // how often the limit's signal comes back
constexpr double kLeastCos = 0.15;        // of incidences: normals are not better than that
constexpr double kPerIntensity = 0.01;    // intensities are percent
constexpr float kStep = 100.0f / 255.0f;  // percent per code

/// Signals by their logarithm, a percent per bin, from 1e-6 to 1e9.
class SignalHistogram {
 public:
  void add(double signal) {
    const double place = (math::log(signal) - kLowest) * kBinsPerUnit;
    ++counts_[static_cast<std::size_t>(
        std::clamp(place, 0.0, static_cast<double>(counts_.size() - 1)))];
    ++all_;
  }
  [[nodiscard]] std::uint64_t count() const { return all_; }
  /// Middle of the bin that it lies in.
  [[nodiscard]] double quantile(double share) const {
    double wanted = share * static_cast<double>(all_);
    std::size_t bin = 0;
    for (; bin + 1 < counts_.size(); ++bin) {
      wanted -= static_cast<double>(counts_[bin]);
      if (wanted < 0.0) break;
    }
    return math::exp(kLowest + (static_cast<double>(bin) + 0.5) / kBinsPerUnit);
  }

 private:
  static constexpr double kLowest = -13.815510557964274;  // ln 1e-6
  static constexpr double kBinsPerUnit = 100.0;
  std::vector<std::uint64_t> counts_ = std::vector<std::uint64_t>(3454);
  std::uint64_t all_ = 0;
};

SignalHistogram signals_of(const SurveyOpener& survey, const Progress& progress) {
  SignalHistogram signals;
  const auto reader = survey();
  std::vector<SurveyRay> batch;
  while (reader->read(batch)) {
    report(progress, "reading signals", reader->share_read());
    for (const SurveyRay& ray : batch) {
      if (ray.is_return && ray.intensity > 0.0f) {
        signals.add(static_cast<double>(ray.intensity));
      }
    }
  }
  return signals;
}

constexpr std::size_t kWeights = 0;
constexpr std::size_t kLogarithms = 1;

std::uint8_t code_of(double reflectivity) {
  const double code = 100.0 * reflectivity / static_cast<double>(kStep);
  return static_cast<std::uint8_t>(std::clamp(std::round(code), 1.0, 255.0));
}

/// Quantile of codes, as a code.
std::uint8_t quantile(const std::array<std::uint64_t, 256>& counts, double share) {
  double wanted = 0.0;
  for (const std::uint64_t count : counts) wanted += share * static_cast<double>(count);
  std::size_t code = 0;
  for (; code < 255; ++code) {
    wanted -= static_cast<double>(counts[code]);
    if (wanted < 0.0) break;
  }
  return static_cast<std::uint8_t>(code);
}

}  // namespace

void paint_reflectivity(EditedMap& edited,
                        const SurveyOpener& survey,
                        const SignalOptions& signal,
                        const EditOptions& options,
                        const Executor& executor,
                        SignalReport& report,
                        const Progress& progress) {
  report = {};
  const DetectionModel sensor(signal.detection, signal.sun_klx);
  if (sensor.is_ideal()) {
    throw InputError("the sensor's file states no rated ranges: its signals cannot be read");
  }
  const SignalHistogram signals = signals_of(survey, progress);
  report.returns = signals.count();
  if (report.returns == 0) throw InputError("the scans carry no intensities above 0");
  report.limit = signal.limit.value_or(signals.quantile(kWeakest));
  const double margin_of_one = sensor.margin_at(kSeenAtLimit) / report.limit;

  const auto map = SurfelMap::from_bytes(map_bytes(edited.tree, edited.description), "the map");
  SurfelEvidence evidence(map->words().size(), 2);
  const auto right = static_cast<float>(signal.right);
  const float window = kernel_map_of(*map).window;
  const auto visit = [&](const SurveyRay& ray, const RayHits& way) {
    if (!ray.is_return || !(ray.intensity > 0.0f)) return;
    if (way.range < 0.0f || std::abs(way.range - ray.range) > right) return;
    const auto range = static_cast<double>(ray.range);
    const double near = sensor.near_gain(range);
    const double facing = margin_of_one * static_cast<double>(ray.intensity) *
                          sensor.rated_reflectivity(range) / near;
    for (const SurfelHit& met : way.hits) {
      if (met.weight <= 0 || met.t < way.first || met.t > way.first + window) continue;
      const Vector3f normal = decode(map->words()[met.word]).axes.col(0);
      const auto cos = static_cast<double>(std::abs(normal.dot(ray.direction_world)));
      const double weight =
          near * near * static_cast<double>(met.weight) / static_cast<double>(kWeightOne);
      evidence.add(met.word, kWeights, weight);
      evidence.add(met.word, kLogarithms, weight * math::log(facing / std::max(cos, kLeastCos)));
    }
  };
  follow_survey(*map, survey, signal.right, executor, "reflectivity of surfels", progress, visit);

  Scratch scratch(options.scratch_folder, options.scratch_memory);
  ScratchArray<std::uint8_t> codes(scratch, map->words().size());
  std::array<std::uint64_t, 256> counts{};
  for_each_surfel(map->words(), [&](const LeafHeader&, std::size_t word) {
    const double weight = evidence.sum(word, kWeights);
    if (weight <= 0.0) {
      ++report.unseen;
      return;
    }
    codes[word] = code_of(math::exp(evidence.sum(word, kLogarithms) / weight));
    ++counts[codes[word]];
  });
  const std::uint8_t darkest = quantile(counts, 0.05);
  for_each_surfel(map->words(), [&](const LeafHeader&, std::size_t word) {
    if (codes[word] == 0) codes[word] = darkest;
  });
  const auto reflectivity = [&](double share) {
    return kPerIntensity * static_cast<double>(kStep) *
           static_cast<double>(quantile(counts, share));
  };
  report.reflectivities = {reflectivity(0.05), reflectivity(0.5), reflectivity(0.95)};
  edited.tree.intensity = std::move(codes);
  edited.description.has_intensity = true;
  set_levels(edited.description, IntensityLevels::linear(0.0f, kStep));
  set_reflectivity(edited.description, kPerIntensity);
  append_note(edited,
              fmt::format("intensities are reflectivities in percent, from the survey's signals, "
                          "the weakest {:.4g}",
                          report.limit));
}

}  // namespace pointflight
