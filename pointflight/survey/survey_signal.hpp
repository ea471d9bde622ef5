// Reflectivities of a map's surfels, from the signals that its survey's sensor received.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "pointflight/core/parallel.hpp"
#include "pointflight/core/progress.hpp"
#include "pointflight/lidar/detection.hpp"
#include "pointflight/map/edit/map_edit.hpp"
#include "pointflight/survey/survey_rays.hpp"

namespace pointflight {

/// What the survey's sensor is, and how its signals are read.
struct SignalOptions {
  DetectionSettings detection;  ///< Of its sensor file; ranges must be rated.
  double sun_klx = 100.0;       ///< Background light of the survey, kilolux.
  /// The weakest signal that the sensor reports, in the scans' scale; without it the one that a
  /// hundredth of the returns do not reach.
  std::optional<double> limit;
  double right = 0.1;  ///< Returns count that the map renders so near, m.
};

/// The result of painting a map.
struct SignalReport {
  double limit = 0.0;                      ///< As above: given, or found.
  std::uint64_t returns = 0;               ///< Of the survey that carry a signal.
  std::uint64_t unseen = 0;                ///< Surfels that none of them hit.
  std::array<double, 3> reflectivities{};  ///< 5, 50 and 95 % quantile over the surfels that were.
};

/// Gives every surfel of a map an intensity that is its reflectivity in percent, 0 to 100, and the
/// map the scale that says so.
///
/// The scans' intensity must be in proportion to the received signal (Ouster's "signal"; not a
/// calibrated reflectivity, for which `set_reflectivity` is). A return of margin m
/// (`DetectionModel`) from range R at the incidence a is of reflectivity
/// m rated_reflectivity(R) / (near_gain(R) cos a), cos a from 0.15 on. The margin is that of the
/// weakest signal, which is taken to come back three times in twenty, times the signal over it. A
/// surfel gets the geometric mean over the returns that it was part of, by its weights there and
/// the square of near_gain. One that no return hit is as dark as the darkest twentieth: that is
/// why it was not seen. Throws InputError if the scans carry no intensity or the sensor has no
/// rated ranges.
void paint_reflectivity(EditedMap& map,
                        const SurveyOpener& survey,
                        const SignalOptions& signal,
                        const EditOptions& options,
                        const Executor& executor,
                        SignalReport& report,
                        const Progress& progress = {});

}  // namespace pointflight
