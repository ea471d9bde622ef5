#include "pointflight/fidelity/survey_report.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "pointflight/core/constants.hpp"
#include "pointflight/core/math.hpp"

namespace pointflight {
namespace {

constexpr double kPatch = 2.0 * kDegree;  // of the distributions of ranges

using Cell = std::array<std::int64_t, 3>;

/// Ranges within one patch, negative where there was no return.
struct Patch {
  std::vector<float> truth;
  std::vector<float> rendered;
  std::size_t foliage = 0;  ///< Beams that meet some.
};

using Patches = std::map<Cell, Patch>;

/// Area between the distributions of two equally long lists, m.
double range_distance(Patch& patch) {
  float farthest = 0.0f;
  for (const auto* ranges : {&patch.truth, &patch.rendered}) {
    farthest = std::max(farthest, *std::max_element(ranges->begin(), ranges->end()));
  }
  for (auto* ranges : {&patch.truth, &patch.rendered}) {
    for (float& range : *ranges) range = range < 0.0f ? farthest : range;
    std::sort(ranges->begin(), ranges->end());
  }
  double sum = 0.0;
  for (std::size_t i = 0; i < patch.truth.size(); ++i) {
    sum += static_cast<double>(std::abs(patch.truth[i] - patch.rendered[i]));
  }
  return sum / static_cast<double>(patch.truth.size());
}

double foliage_distance(Patches& patches) {
  double sum = 0.0;
  std::size_t count = 0;
  for (auto& [place, patch] : patches) {
    if (2 * patch.foliage < patch.truth.size()) continue;
    sum += range_distance(patch);
    ++count;
  }
  return count > 0 ? sum / static_cast<double>(count) : 0.0;
}

}  // namespace

bool is_foliage(const std::string& tag) {
  constexpr std::array<std::string_view, 5> kKinds = {"leaf", "needle", "grass", "net", "bush"};
  return std::any_of(
      kKinds.begin(), kKinds.end(), [&](std::string_view kind) { return tag.starts_with(kind); });
}

SurveyReport measure_survey(const ExactScene& scene,
                            const SceneBeams& beams,
                            const SurveyedPlaces& surveyed,
                            const Renderer& renderer,
                            const Executor& executor) {
  SurveyReport report;
  report.rendered = measure_fidelity(scene, beams, renderer, executor).rendered;
  ErrorCollector all;
  ErrorCollector inside;
  ErrorCollector edge;
  ErrorCollector foliage;
  ErrorCollector unseen;
  ErrorCollector sky;
  Patches patches;
  for (std::size_t i = 0; i < beams.beams.size(); ++i) {
    const TrueBeam& beam = beams.beams[i];
    const float rendered = report.rendered[i];
    const bool leafy = beam.range >= 0.0f && is_foliage(scene.tags[beam.tag]);
    const Vector3d d = beam.ray.direction_world.cast<double>();
    Patch& patch = patches[{static_cast<std::int64_t>(i / beams.per_pose()),
                            floor_to_integer(math::atan2(d.y(), d.x()) / kPatch),
                            floor_to_integer(math::asin(std::clamp(d.z(), -1.0, 1.0)) / kPatch)}];
    patch.truth.push_back(beam.range);
    patch.rendered.push_back(rendered);
    patch.foliage += leafy ? 1 : 0;
    if (beam.range < 0.0f) {
      sky.add_empty(rendered >= 0.0f);
      continue;
    }
    std::optional<double> range;
    if (rendered >= 0.0f) range = static_cast<double>(rendered);
    const auto truth = static_cast<double>(beam.range);
    if (!surveyed.has(beam.ray.origin_world + truth * d)) {
      unseen.add(truth, range);
      continue;
    }
    all.add(truth, range);
    (leafy ? foliage : beam.silhouette ? edge : inside).add(truth, range);
  }
  report.all = all.statistics();
  report.inside = inside.statistics();
  report.edge = edge.statistics();
  report.foliage = foliage.statistics();
  report.unseen = unseen.statistics();
  report.sky = sky.statistics();
  report.foliage_distance = foliage_distance(patches);
  return report;
}

}  // namespace pointflight
