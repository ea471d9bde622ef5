#include <fmt/format.h>

#include <memory>
#include <utility>

#include "apps/cli.hpp"
#include "apps/flags.hpp"
#include "apps/map_edit.hpp"
#include "apps/survey_flags.hpp"
#include "apps/terminal.hpp"
#include "pointflight/core/input_error.hpp"
#include "pointflight/map/fitted_scans.hpp"
#include "pointflight/survey/scan_fingerprint.hpp"

namespace pointflight::apps {
namespace {

struct MapFitFlags : EditFlags {
  FitFlags fit;
};

void run_fit(const MapFitFlags& flags) {
  if (!check_edit(flags, {{flags.fit.ghosts_out}, survey_inputs(flags.fit)}))
    throw InputError("map fit: a .pfmap in and a .pfmap out are wanted");
  if (!flags.format.empty()) throw InputError("map fit: --format is for clouds");
  const auto map = open_sound_map(flags.inputs.front());
  OutputFile output(flags.output);
  auto ghosts = open_ghosts(flags.fit);
  const Executor executor(flags.threads);
  const Progress progress = interruptible_progress();
  const auto survey = open_survey(flags.fit, progress);
  check_signal(flags.fit, *survey);
  const auto rays = [&] { return survey->open(); };
  FitReport report;
  ClosingReport closed;
  EditedMap fitted = fit_and_close(*map,
                                   rays,
                                   fit_options(flags.fit),
                                   closing_options(flags.fit),
                                   edit_options(flags, {}),
                                   executor,
                                   report,
                                   closed,
                                   progress);
  add_fitted_scans(fitted.description, scan_fingerprints(rays));
  append_note(fitted, fit_note(*survey, report));
  paint_by_signal(fitted, flags.fit, *survey, edit_options(flags, {}), executor, progress);
  const auto written =
      SurfelMap::from_bytes(map_bytes(fitted.tree, fitted.description), flags.output);
  const OwnRays after =
      measure_rays(*written, rays, fit_options(flags.fit).right, {}, executor, progress);
  end_progress();
  print_closed(flags.fit, closed);
  print_fit(report, after);
  OutputSet outputs;
  finish_map(flags, std::move(output), fitted);
  write_ghosts(std::move(ghosts), report);
  outputs.commit();
}

}  // namespace

void add_fit(CLI::App& parent) {
  auto* app = parent.add_subcommand(
      "fit", "Fit a map to the scans that it was made of: what their rays passed is free");
  auto flags = std::make_shared<MapFitFlags>();
  app->add_option("input", flags->inputs, "A .pfmap")->required()->expected(1);
  add_fit_flags(*app, flags->fit, true);
  add_edit_flags(*app, *flags, "The .pfmap to write", true);
  app->footer(
      "Example: pointflight map fit hall.pfmap --scans scans/ --poses poses.tum -o fitted.pfmap");
  app->callback([flags] { run_fit(*flags); });
}

}  // namespace pointflight::apps
