// A map made of a survey: of its points, fitted to its rays, at the resolution that suits it.
#pragma once

#include <optional>
#include <vector>

#include "pointflight/map/import/map_builder.hpp"
#include "pointflight/survey/hole_closing.hpp"
#include "pointflight/survey/map_fit.hpp"
#include "pointflight/survey/posed_scans.hpp"
#include "pointflight/survey/resolution_search.hpp"

namespace pointflight {

/// How a survey becomes a map.
struct SurveyMapOptions {
  /// Of the points. Without a resolution the best one is found with the returns alone: clouds hold
  /// points of the scans that judge. It is not finer than clouds support.
  ImportOptions import;
  FitOptions fit;  ///< To the rays.
  /// How holes in floors and walls are closed after the fit; nothing: they stay.
  std::optional<ClosingOptions> closing = ClosingOptions{};
};

/// `fit_map`, then, with `closing`, `close_holes`.
EditedMap fit_and_close(const SurfelMap& map,
                        const SurveyOpener& survey,
                        const FitOptions& fit,
                        const std::optional<ClosingOptions>& closing,
                        const EditOptions& options,
                        const Executor& executor,
                        FitReport& fitted,
                        ClosingReport& closed,
                        const Progress& progress = {});

/// A finished map of a survey.
struct SurveyMap {
  EditedMap map;                       ///< Fitted.
  ImportReport imported;               ///< Before the fit.
  std::vector<CloudPoint> outliers;    ///< Of the import.
  ClosingReport closed;                ///< After the fit; zeros without.
  FitReport fit;                       ///< The fit.
  OwnRays after;                       ///< The survey's rays in the fitted map.
  std::vector<TriedResolution> tried;  ///< In ascending order; empty if one was given.
};

/// Scans that can be opened as often as wanted, all or those that a function accepts.
using ScanOpener = std::function<std::unique_ptr<SurveyReader>(
    const std::function<bool(std::size_t scan)>& chosen)>;

/// Clouds that were made of the scans; without names the survey's returns are the map's points.
struct SurveyPoints {
  std::vector<std::string> names;  ///< For messages.
  CloudOpener open;                ///< One of them at its beginning.
};

/// Tries resolutions (`search_resolutions`): maps of the returns of nine tenths of the scans,
/// fitted to these, judged by what the others see (`measure_surface`): rays that end where the nine
/// tenths saw something and those without a return. The others are three stretches of a thirtieth
/// of the scans each, or every tenth scan of fewer than 30. Two scans at least. Throws InputError.
std::vector<TriedResolution> try_resolutions(const ScanOpener& survey,
                                             std::size_t scan_count,
                                             const SurveyMapOptions& options,
                                             const Executor& executor,
                                             const Progress& progress = {});

/// Makes the map of a survey: its points' surfels, fitted to the rays, holes closed.
SurveyMap map_survey(const SurveySource& survey,
                     const SurveyPoints& points,
                     const SurveyMapOptions& options,
                     const Executor& executor,
                     const Progress& progress = {});

}  // namespace pointflight
