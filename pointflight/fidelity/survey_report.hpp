#pragma once

#include <string>
#include <vector>

#include "pointflight/fidelity/scene_beams.hpp"
#include "pointflight/fidelity/seen_surfaces.hpp"

namespace pointflight {

/// How a map of a survey renders beams whose truth is known.
struct SurveyReport {
  ErrorStatistics all;            ///< Of beams that hit something that the survey has seen.
  ErrorStatistics inside;         ///< Firm surfaces away from edges.
  ErrorStatistics edge;           ///< Firm surfaces beside a jump in range.
  ErrorStatistics foliage;        ///< Leaves, grass, nets: what lets beams through.
  ErrorStatistics unseen;         ///< What no scan saw: no return near from that side.
  ErrorStatistics sky;            ///< Beams that hit nothing: `false_fraction` counts.
  double foliage_distance = 0.0;  ///< Between distributions of ranges, m.
  /// The same between what the beams hit in truth and what others 0.1 degrees beside them hit, as
  /// a yardstick.
  double foliage_distance_beside = 0.0;
  std::vector<float> rendered;  ///< Of each beam, m; negative if nothing was hit.
};

/// True for tags of things that let beams through: leaf, needle, grass, net, bush.
bool is_foliage(const std::string& tag);

/// Renders the beams and sorts them into classes. `foliage_distance`: if half of the rays pass,
/// no fixed surface is right more than half of the time, so patches of 2 x 2 degrees in which at
/// least half of the beams hit foliage are judged by the area between the cumulative distributions
/// of the true and the rendered ranges (first Wasserstein distance), the mean of all patches. A
/// beam without a return counts with the farthest range of its patch, true or rendered.
SurveyReport measure_survey(const ExactScene& scene,
                            const SceneBeams& beams,
                            const SeenSurfaces& surveyed,
                            const Renderer& renderer,
                            const Executor& executor);

}  // namespace pointflight
