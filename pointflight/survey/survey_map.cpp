#include "pointflight/survey/survey_map.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "pointflight/core/argument.hpp"
#include "pointflight/map/fitted_scans.hpp"
#include "pointflight/map/import/import_check.hpp"
#include "pointflight/map/map_file.hpp"
#include "pointflight/survey/scan_fingerprint.hpp"
#include "pointflight/survey/supported_cells.hpp"
#include "pointflight/survey/surface_share.hpp"

namespace pointflight {
namespace {

constexpr std::size_t kLeftOut = 10;    // one stretch of the survey of so many judges
constexpr std::size_t kStretches = 30;  // scans shot in a row see the same from the same position
constexpr double kLevel = 0.0005;       // of what left out scans saw: of equals the finer

EditOptions edit_options_of(const ImportOptions& options) {
  EditOptions edit;
  edit.quality = options.quality;
  edit.scratch_folder = options.scratch_folder;
  edit.scratch_memory = options.scratch_memory;
  return edit;
}

std::shared_ptr<const SurfelMap> opened(const Bvh8& tree, const MapDescription& description) {
  return SurfelMap::from_bytes(map_bytes(tree, description), "the survey's map");
}

ImportedMap import_returns(const SurveyOpener& survey,
                           const ImportOptions& options,
                           const Executor& executor,
                           const Progress& progress) {
  const auto returns = [&](std::size_t) { return cloud_of(survey()); };
  return build_map({"the scans"}, returns, options, executor, progress);
}

/// At the options' resolution, but not finer than the points support if it was tried with the
/// returns, of which there are more.
ImportedMap import_points(const SurveyPoints& points,
                          const SurveyOpener& survey,
                          ImportOptions& options,
                          const Executor& executor,
                          const Progress& progress) {
  if (points.names.empty()) return import_returns(survey, options, executor, progress);
  ImportedMap made = build_map(points.names, points.open, options, executor, progress);
  const double supported = made.report.supported_resolution;
  if (!options.resolution_is_tried || supported <= made.report.resolution) return made;
  made = {};
  options.resolution.reset();
  options.resolution_is_tried = false;
  return build_map(points.names, points.open, options, executor, progress);
}

}  // namespace

EditedMap fit_and_close(const SurfelMap& map,
                        const SurveyOpener& survey,
                        const FitOptions& fit,
                        const std::optional<ClosingOptions>& closing,
                        const EditOptions& options,
                        const Executor& executor,
                        FitReport& fitted,
                        ClosingReport& closed,
                        const Progress& progress) {
  closed = {};
  EditedMap made = fit_map(map, survey, fit, options, executor, fitted, progress);
  if (!closing) return made;
  const auto with_holes = opened(made.tree, made.description);
  made = {};  // room for the next
  made = close_holes(*with_holes, survey, *closing, options, executor, closed, progress);
  made.surfels_before = map.surfel_count();
  return made;
}

std::vector<TriedResolution> try_resolutions(const ScanOpener& survey,
                                             std::size_t scan_count,
                                             const SurveyMapOptions& options,
                                             const Executor& executor,
                                             const Progress& progress) {
  require_argument(scan_count >= 2, "try_resolutions: two scans at least are wanted");
  const auto is_left_out = [&](std::size_t scan) {
    const std::size_t stretch = scan_count < kStretches ? scan : kStretches * scan / scan_count;
    return stretch % kLeftOut == std::min(kLeftOut, scan_count) / 2;
  };
  const SurveyOpener learnt = [&] {
    return survey([&](std::size_t scan) { return !is_left_out(scan); });
  };
  const SurveyOpener judges = [&] { return survey(is_left_out); };
  const SupportedCells seen = supported_by(learnt);
  const auto counts = [&](const SurveyRay& ray) {
    return !ray.is_return || seen.has(ray.point_world());
  };
  ImportOptions chosen = options.import;
  chosen.quality = TreeQuality::kNormal;  // of use for minutes
  FitOptions quick = options.fit;
  quick.known_space = false;
  quick.blame_passes = 1;  // a second one would take half as long again
  const auto try_one = [&](const std::optional<double>& resolution) {
    chosen.resolution = resolution;
    const ImportedMap imported = import_returns(learnt, chosen, executor, progress);
    FitReport report;
    ClosingReport closed;
    const EditedMap fitted = fit_and_close(*opened(imported.tree, imported.description),
                                           learnt,
                                           quick,
                                           options.closing,
                                           edit_options_of(chosen),
                                           executor,
                                           report,
                                           closed,
                                           progress);
    const SurfaceShare share = measure_surface(
        *opened(fitted.tree, fitted.description), judges, quick.right, counts, executor, progress);
    return TriedResolution{imported.report.resolution, share.right, share.rays};
  };
  return search_resolutions(try_one, 0.0);
}

SurveyMap map_survey(const SurveySource& survey,
                     const SurveyPoints& points,
                     const SurveyMapOptions& options,
                     const Executor& executor,
                     const Progress& progress) {
  SurveyMap made;
  ImportOptions chosen = options.import;
  const ScanOpener some = [&](const auto& accept) { return survey.open(accept); };
  const SurveyOpener all = [&] { return survey.open(); };
  if (!chosen.resolution && survey.scan_count() > 1) {
    made.tried = try_resolutions(some, survey.scan_count(), options, executor, progress);
    chosen.resolution = best_resolution(made.tried, kLevel);
    chosen.resolution_is_tried = made.tried.front().rays > 0;
  }
  ImportedMap imported = import_points(points, all, chosen, executor, progress);
  made.imported = imported.report;
  // by the spacing, if no scans were left out to judge or the clouds support none so fine
  made.imported.resolution_was_chosen =
      !options.import.resolution && (made.tried.empty() || !chosen.resolution);
  made.imported.warnings =
      import_warnings(made.imported, options.import, imported.description.bounds_world);
  made.outliers = std::move(imported.outliers);
  const auto map = opened(imported.tree, imported.description);
  imported = {};  // room for the fit
  made.map = fit_and_close(*map,
                           all,
                           options.fit,
                           options.closing,
                           edit_options_of(chosen),
                           executor,
                           made.fit,
                           made.closed,
                           progress);
  add_fitted_scans(made.map.description, scan_fingerprints(all));
  append_note(made.map,
              fmt::format("fit to {} rays of {} scans", made.fit.rays, survey.scan_count()));
  made.after = measure_rays(
      *opened(made.map.tree, made.map.description), all, options.fit.right, {}, executor, progress);
  return made;
}

}  // namespace pointflight
