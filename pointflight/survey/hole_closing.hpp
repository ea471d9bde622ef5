// Floors and walls go on between what a survey saw of them: surfels that are assumed.
#pragma once

#include <cstdint>

#include "pointflight/core/parallel.hpp"
#include "pointflight/core/progress.hpp"
#include "pointflight/map/edit/map_edit.hpp"
#include "pointflight/survey/plane_holes.hpp"
#include "pointflight/survey/survey_rays.hpp"

namespace pointflight {

/// How holes are closed.
struct ClosingOptions {
  LargePlaneOptions planes;  ///< What has holes.
  HoleOptions holes;         ///< What is one.
  double right = 0.1;        ///< A ray passes a surfel if it ends so far behind it, m.
  /// A ray that ends so far off the surfel's plane has gone through an opening, m.
  double through = 0.15;
  double opening = 0.5;  ///< Around what rays have gone through nothing is closed, m.
};

/// What was done.
struct ClosingReport {
  std::uint64_t planes = 0;   ///< Large ones.
  std::uint64_t cells = 0;    ///< Of holes in them.
  std::uint64_t passed = 0;   ///< Of these, passed by rays.
  std::uint64_t opening = 0;  ///< Of these, beside what rays have gone through.
  std::uint64_t assumed = 0;  ///< Surfels of the result that are assumed.
};

/// The map with surfels in the holes of its large planes, as far as no ray of the survey passes
/// them (by the hit rule) and nothing says that there is an opening; they are marked as assumed.
/// Assumed surfels that the map has are judged with them. Sums of whole numbers: the same bytes for
/// any number of threads.
EditedMap close_holes(const SurfelMap& map,
                      const SurveyOpener& survey,
                      const ClosingOptions& closing,
                      const EditOptions& options,
                      const Executor& executor,
                      ClosingReport& report,
                      const Progress& progress = {});

}  // namespace pointflight
