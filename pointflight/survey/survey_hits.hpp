#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "pointflight/core/parallel.hpp"
#include "pointflight/core/progress.hpp"
#include "pointflight/map/surfel_map.hpp"
#include "pointflight/render/internal/all_hits_kernel.hpp"
#include "pointflight/survey/survey_rays.hpp"

namespace pointflight {

/// Follows every ray of the survey to its end, and as far behind a return as decides whether it is
/// rendered within `right` (m) of it. `visit` is called from several threads, in no order. Returns
/// how many lists of surfels overflowed (`find_all_hits`).
std::uint64_t follow_survey(const SurfelMap& map,
                            const SurveyOpener& survey,
                            double right,
                            const Executor& executor,
                            const std::string& stage,
                            const Progress& progress,
                            const std::function<void(const SurveyRay&, const RayHits&)>& visit);

}  // namespace pointflight
