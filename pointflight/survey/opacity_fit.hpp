// Which surfels of a fitted map send back a part of the beams alone.
#pragma once

#include <cstdint>

#include "pointflight/core/parallel.hpp"
#include "pointflight/core/progress.hpp"
#include "pointflight/map/edit/map_edit.hpp"
#include "pointflight/survey/survey_rays.hpp"

namespace pointflight {

/// Parameters of `fit_opacity`.
struct OpacityOptions {
  double right = 0.1;      ///< A return is a surfel's own if it is so near, m.
  double share_max = 0.9;  ///< Surfels that send more than that back are opaque.
  double rays_min = 8.0;   ///< Of which as many are known of at least.
};

/// Follows the survey's rays as they would be rendered (`Opacity`: what goes through a surfel goes
/// on a cell behind it) and counts for each surfel that would be hit how many rays returned there
/// and how many went on. Its opacity is (returns + 1) / (rays + 1), if that is a small share.
/// Written into the map's notes; returns how many surfels are not opaque. Assumed surfels stay as
/// they are. The same for any number of threads.
std::uint64_t fit_opacity(EditedMap& map,
                          const SurveyOpener& survey,
                          const OpacityOptions& options,
                          const Executor& executor,
                          const Progress& progress = {});

}  // namespace pointflight
