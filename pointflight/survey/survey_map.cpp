#include "pointflight/survey/survey_map.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "pointflight/core/argument.hpp"
#include "pointflight/map/import/import_check.hpp"
#include "pointflight/map/map_file.hpp"
#include "pointflight/survey/surveyed_cells.hpp"

namespace pointflight {
namespace {

constexpr std::size_t kLeftOut = 10;  // one scan of so many judges
// share of the rays: what is smaller than they tell is not lost without need
constexpr double kLevel = 0.003;

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

/// The points of a cloud beside which a survey saw something.
class SeenCloud : public CloudReader {
 public:
  SeenCloud(std::unique_ptr<CloudReader> cloud, const SurveyedCells& seen)
      : cloud_(std::move(cloud)), seen_(seen) {}

  bool read(std::vector<CloudPoint>& batch) override {
    while (cloud_->read(batch)) {
      std::erase_if(batch, [&](const CloudPoint& p) { return !seen_.has(p.position); });
      if (!batch.empty()) return true;
    }
    return false;
  }
  [[nodiscard]] bool has_intensity() const override { return cloud_->has_intensity(); }
  [[nodiscard]] bool has_color() const override { return cloud_->has_color(); }
  [[nodiscard]] std::optional<FileUnit> unit() const override { return cloud_->unit(); }
  [[nodiscard]] double share_read() const override { return cloud_->share_read(); }

 private:
  std::unique_ptr<CloudReader> cloud_;
  const SurveyedCells& seen_;
};

/// Of the points, or of the survey's returns; with `seen` of those that lie beside its positions.
ImportedMap import_points(const SurveyPoints& points,
                          const SurveyOpener& survey,
                          const SurveyedCells* seen,
                          const ImportOptions& options,
                          const Executor& executor,
                          const Progress& progress) {
  if (points.names.empty()) {
    const auto returns = [&](std::size_t) { return cloud_of(survey()); };
    return build_map({"the scans"}, returns, options, executor, progress);
  }
  const auto cloud = [&](std::size_t i) -> std::unique_ptr<CloudReader> {
    if (seen == nullptr) return points.open(i);
    return std::make_unique<SeenCloud>(points.open(i), *seen);
  };
  return build_map(points.names, cloud, options, executor, progress);
}

}  // namespace

std::vector<TriedResolution> try_resolutions(const ScanOpener& survey,
                                             std::size_t scan_count,
                                             const SurveyPoints& points,
                                             const ImportOptions& options,
                                             const FitOptions& fit,
                                             const Executor& executor,
                                             const Progress& progress) {
  require_argument(scan_count >= 2, "try_resolutions: two scans at least are wanted");
  const auto is_left_out = [&](std::size_t scan) {
    return scan % kLeftOut == std::min(kLeftOut, scan_count) / 2;
  };
  const SurveyOpener learnt = [&] {
    return survey([&](std::size_t scan) { return !is_left_out(scan); });
  };
  const SurveyOpener judges = [&] { return survey(is_left_out); };
  const SurveyedCells seen = surveyed_cells(learnt);
  const auto counts = [&](const SurveyRay& ray) {
    return !ray.is_return || seen.has(ray.point_world());
  };
  ImportOptions chosen = options;
  chosen.quality = TreeQuality::kNormal;  // of use for minutes
  FitOptions quick = fit;
  quick.known_space = false;
  quick.blame_passes = 1;  // a second one would take half as long again
  const auto try_one = [&](const std::optional<double>& resolution) {
    chosen.resolution = resolution;
    const ImportedMap imported = import_points(points, learnt, &seen, chosen, executor, progress);
    FitReport report;
    const EditedMap fitted = fit_map(*opened(imported.tree, imported.description),
                                     learnt,
                                     quick,
                                     edit_options_of(chosen),
                                     executor,
                                     report,
                                     progress);
    const OwnRays rays = measure_rays(
        *opened(fitted.tree, fitted.description), judges, fit.right, counts, executor, progress);
    return TriedResolution{
        imported.report.resolution, rays.right_share(), rays.returns + rays.empty};
  };
  return search_resolutions(try_one, 0.0);
}

SurveyMap map_survey(const SurveySource& survey,
                     const SurveyPoints& points,
                     const ImportOptions& options,
                     const FitOptions& fit,
                     const Executor& executor,
                     const Progress& progress) {
  SurveyMap made;
  ImportOptions chosen = options;
  const ScanOpener some = [&](const auto& accept) { return survey.open(accept); };
  const SurveyOpener all = [&] { return survey.open(); };
  if (!chosen.resolution && survey.scan_count() > 1) {
    made.tried =
        try_resolutions(some, survey.scan_count(), points, options, fit, executor, progress);
    chosen.resolution = best_resolution(made.tried, kLevel);
    chosen.resolution_is_tried = made.tried.front().rays > 0;
  }
  ImportedMap imported = import_points(points, all, nullptr, chosen, executor, progress);
  made.imported = imported.report;
  // by the spacing, if no scans were left out to judge
  made.imported.resolution_was_chosen = !options.resolution && made.tried.empty();
  made.imported.warnings =
      import_warnings(made.imported, options, imported.description.bounds_world);
  made.outliers = std::move(imported.outliers);
  const auto map = opened(imported.tree, imported.description);
  imported = {};  // room for the fit
  made.map = fit_map(*map, all, fit, edit_options_of(chosen), executor, made.fit, progress);
  append_note(made.map,
              fmt::format("fit to {} rays of {} scans", made.fit.rays, survey.scan_count()));
  made.after = measure_rays(
      *opened(made.map.tree, made.map.description), all, fit.right, {}, executor, progress);
  return made;
}

}  // namespace pointflight
