// A map made of a survey: of its points, fitted to its rays, at the resolution that suits it.
#pragma once

#include <vector>

#include "pointflight/map/import/map_builder.hpp"
#include "pointflight/survey/map_fit.hpp"
#include "pointflight/survey/posed_scans.hpp"
#include "pointflight/survey/resolution_search.hpp"

namespace pointflight {

/// A finished map of a survey.
struct SurveyMap {
  EditedMap map;                       ///< Fitted.
  ImportReport imported;               ///< Before the fit.
  std::vector<CloudPoint> outliers;    ///< Of the import.
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

/// Tries resolutions (`search_resolutions`): maps of the points beside which nine tenths of the
/// scans saw something, fitted to these, judged by the rays of the others: those that end where the
/// nine tenths saw something and those without a return. Without `points` the returns of the nine
/// tenths. Two scans at least. Throws InputError.
std::vector<TriedResolution> try_resolutions(const ScanOpener& survey,
                                             std::size_t scan_count,
                                             const SurveyPoints& points,
                                             const ImportOptions& options,
                                             const FitOptions& fit,
                                             const Executor& executor,
                                             const Progress& progress = {});

/// Makes the map of a survey. Without a resolution in
/// `options` the best one is found.
SurveyMap map_survey(const SurveySource& survey,
                     const SurveyPoints& points,
                     const ImportOptions& options,
                     const FitOptions& fit,
                     const Executor& executor,
                     const Progress& progress = {});

}  // namespace pointflight
