// A map fitted to the rays of the survey that it was made of: each says that the space up to its
// return is free.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "pointflight/core/parallel.hpp"
#include "pointflight/core/progress.hpp"
#include "pointflight/map/edit/map_edit.hpp"
#include "pointflight/survey/survey_rays.hpp"

namespace pointflight {

/// Parameters of a fit.
struct FitOptions {
  double right = 0.1;        ///< A return is right so near, m.
  double exponent = 1.0;     ///< Pass 1: sizes times (hits / (hits + passes))^exponent.
  double step = 0.7;         ///< Pass 2: of ln(size) for blame alone.
  double doubt = 0.3;        ///< Pass 2: evidence below this weight changes little.
  double leak_weight = 1.5;  ///< A ray that leaks counts as so many early ones.
  double growth_max = 2.0;   ///< Pass 2: of a size.
  double shift_step = 2.0;   ///< Pass 2: of a centre for blame alone, in standard deviations.
  double shift_max = 0.7;    ///< Pass 2: of a centre, in standard deviations.
  /// Pass 2, the first time: leaks that are expected along each axis of a planar surfel, beside
  /// those of the survey's rays. Each of these ended on a surfel of its own; where returns are few,
  /// others would get through between them.
  double expected_leaks = 5.0;
  /// Surfels with a smaller share of hits than this, passed with a weight of `ghost_passes` or
  /// more, are of what moved: they go.
  double ghost_share = 0.03;
  double ghost_passes = 12.0;  ///< As full weights.
  /// Pass 2: a surfel with three early rays or more that make up this share of its weight goes.
  double blame_share = 0.9;
  int blame_passes = 2;  ///< How often pass 2 is made; each sees what the one before has changed.
  bool known_space = true;  ///< Write down which space the rays crossed.
  bool opacity = false;     ///< Last, find out which surfels let beams through (`fit_opacity`).
};

/// How a survey's rays fare in a map.
struct OwnRays {
  std::uint64_t returns = 0;  ///< Rays that returned in the survey.
  std::uint64_t right = 0;    ///< Of these, rendered within `FitOptions::right`.
  std::uint64_t early = 0;    ///< Nearer.
  std::uint64_t leaks = 0;    ///< Farther, or not at all.
  std::uint64_t empty = 0;    ///< Rays without a return.
  std::uint64_t stopped = 0;  ///< Of these, rendered within what was free.

  /// Of all rays, those without a return included.
  [[nodiscard]] double right_share() const {
    const auto all = static_cast<double>(returns + empty);
    return all > 0.0 ? static_cast<double>(right + empty - stopped) / all : 0.0;
  }
};

/// What a fit did.
struct FitReport {
  std::uint64_t rays = 0;        ///< Of the survey.
  OwnRays before;                ///< In the map as it was.
  OwnRays between;               ///< After pass 1.
  std::uint64_t unseen = 0;      ///< Surfels that no ray hit, left as they were.
  std::uint64_t blamed = 0;      ///< Removed by pass 2.
  std::uint64_t clear = 0;       ///< Surfels that let beams through.
  std::vector<Vector3d> ghosts;  ///< Centres of the surfels of what moved, removed by pass 1.
  /// How often a ray hit more surfels than fit in its list, and was ended there.
  std::uint64_t overflows = 0;
};

/// Passes over the rays, in memory that depends on the map alone: some 140 bytes per surfel.
///
/// Pass 1 sums for each surfel the weights (of the hit rule) of rays that passed it, ending `right`
/// behind it or farther, and of those that ended at it, and makes it smaller by their share. Pass 2
/// renders the rays and sums for each surfel that had a part in it dw / d(ln s_k), of rays rendered
/// early, right, and late or not at all: ln s_k changes by -step (E - L) / (E + L + C + doubt) with
/// the leaks L weighed and, for planar surfels, `expected_leaks` (C / (C + E))^2 added. Centres
/// move in the same way by dw / d(centre), away from where rays are early and to where they leak,
/// in their voxel. Planar surfels stay planar, and in their plane. Pass 2 also marks the space that
/// rays crossed, in the box of the surfels and the sensor's positions, beside what the map knew.
/// All sums are of whole numbers: the same bytes for any number of threads and any order of the
/// rays.
EditedMap fit_map(const SurfelMap& map,
                  const SurveyOpener& survey,
                  const FitOptions& fit,
                  const EditOptions& options,
                  const Executor& executor,
                  FitReport& report,
                  const Progress& progress = {});

/// Renders a survey's rays, those that `counts` accepts; all without it.
OwnRays measure_rays(const SurfelMap& map,
                     const SurveyOpener& survey,
                     double right,
                     const std::function<bool(const SurveyRay&)>& counts,
                     const Executor& executor,
                     const Progress& progress = {});

}  // namespace pointflight
