#pragma once

#include <cstdint>
#include <functional>

#include "pointflight/core/parallel.hpp"
#include "pointflight/core/progress.hpp"
#include "pointflight/map/surfel_map.hpp"
#include "pointflight/survey/survey_rays.hpp"

namespace pointflight {

/// How much of what rays see a map renders right.
struct SurfaceShare {
  double right = 0.0;      ///< From 0 to 1.
  std::uint64_t rays = 0;  ///< That judged it.
};

/// Renders a survey's rays, those that `counts` accepts. Returns that end in the same cell of 0.2 m
/// share one vote, so that every piece of surface counts the same, however often the survey looked
/// at it: a map is for those who will look from elsewhere, and may stand before what the survey saw
/// from afar. Rays without a return count as they are many. The same for any number of threads.
SurfaceShare measure_surface(const SurfelMap& map,
                             const SurveyOpener& survey,
                             double right,
                             const std::function<bool(const SurveyRay&)>& counts,
                             const Executor& executor,
                             const Progress& progress = {});

}  // namespace pointflight
