#include "pointflight/fidelity/survey_report.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "pointflight/core/constants.hpp"
#include "pointflight/core/floor.hpp"
#include "pointflight/core/math.hpp"

namespace pointflight {
namespace {

constexpr double kPatch = 2.0 * kDegree;  // of the distributions of ranges

using Cell = std::array<std::int64_t, 3>;

/// Ranges within one patch, negative if there was no return.
struct Patch {
  std::vector<float> truth;
  std::vector<float> rendered;
  std::vector<float> beside;  ///< In truth, of other beams.
  std::size_t foliage = 0;    ///< Beams that hit some.
};

using Patches = std::map<Cell, Patch>;

/// Area between the distributions of two equally long lists, m.
double range_distance(std::vector<float> a, std::vector<float> b) {
  const float farthest =
      std::max(*std::max_element(a.begin(), a.end()), *std::max_element(b.begin(), b.end()));
  for (auto* ranges : {&a, &b}) {
    for (float& range : *ranges) range = range < 0.0f ? farthest : range;
    std::sort(ranges->begin(), ranges->end());
  }
  double sum = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += static_cast<double>(std::abs(a[i] - b[i]));
  return sum / static_cast<double>(a.size());
}

/// Mean of the patches that show foliage.
double foliage_distance(const Patches& patches, std::vector<float> Patch::*ranges) {
  double sum = 0.0;
  std::size_t count = 0;
  for (const auto& [place, patch] : patches) {
    if (2 * patch.foliage < patch.truth.size()) continue;
    sum += range_distance(patch.truth, patch.*ranges);
    ++count;
  }
  return count > 0 ? sum / static_cast<double>(count) : 0.0;
}

}  // namespace

bool is_foliage(const std::string& tag) {
  constexpr std::array<std::string_view, 6> kKinds = {
      "leaf", "leaves", "needle", "grass", "net", "bush"};
  return std::any_of(
      kKinds.begin(), kKinds.end(), [&](std::string_view kind) { return tag.starts_with(kind); });
}

SurveyReport measure_survey(const ExactScene& scene,
                            const SceneBeams& beams,
                            const SeenSurfaces& surveyed,
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
    patch.beside.push_back(beam.range_beside);
    patch.foliage += leafy ? 1 : 0;
    if (beam.range < 0.0f) {
      sky.add_empty(rendered >= 0.0f);
      continue;
    }
    std::optional<double> range;
    if (rendered >= 0.0f) range = static_cast<double>(rendered);
    const auto truth = static_cast<double>(beam.range);
    if (!surveyed.has(beam.ray.origin_world + truth * d, beam.normal_world)) {
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
  report.foliage_distance = foliage_distance(patches, &Patch::rendered);
  report.foliage_distance_beside = foliage_distance(patches, &Patch::beside);
  return report;
}

}  // namespace pointflight
