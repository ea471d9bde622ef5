#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <memory>
#include <optional>

#include "apps/cli.hpp"
#include "apps/flags.hpp"
#include "apps/import_report.hpp"
#include "apps/input_kind.hpp"
#include "apps/map_edit.hpp"
#include "apps/survey_flags.hpp"
#include "apps/terminal.hpp"
#include "pointflight/core/input_error.hpp"
#include "pointflight/io/pcd_writer.hpp"
#include "pointflight/map/import/map_builder.hpp"
#include "pointflight/survey/cloud_map.hpp"

namespace pointflight::apps {
namespace {

struct ImportFlags {
  std::vector<std::string> inputs;
  std::string output;
  double resolution = 0.0;
  double scale = 1.0;
  std::vector<double> shift;
  std::string up = "z";
  double tau = 0.0;  ///< 0: by the density.
  std::string quality = "high";
  bool keep_outliers = false;
  int outlier_neighbours = 8;
  double outlier_sigmas = OutlierOptions{}.sigmas;
  std::string outliers_out;
  std::string scratch;
  std::string format;
  FitFlags fit;
  double reflectivity = 0.0;  ///< 0: not calibrated.
  bool force = false;
  int threads = 0;
};

std::string folder_of(const std::string& path) {
  const std::filesystem::path folder = std::filesystem::path(path).parent_path();
  return folder.empty() ? "." : folder.string();
}

ImportOptions import_options(const ImportFlags& flags) {
  ImportOptions options;
  if (flags.resolution > 0.0) options.resolution = flags.resolution;
  options.scale = flags.scale;
  if (!flags.shift.empty()) options.shift = Vector3d(flags.shift.data());
  options.up = flags.up.front();
  options.quality = flags.quality == "high" ? TreeQuality::kHigh : TreeQuality::kNormal;
  if (flags.tau > 0.0) options.tau = static_cast<float>(flags.tau);
  options.outliers.enabled = !flags.keep_outliers;
  options.outliers.neighbours = flags.outlier_neighbours;
  options.outliers.sigmas = flags.outlier_sigmas;
  options.scratch_folder = flags.scratch.empty() ? folder_of(flags.output) : flags.scratch;
  return options;
}

void print_end(const ImportFlags& flags,
               const ImportReport& report,
               std::chrono::steady_clock::time_point start) {
  for (const std::string& warning : report.warnings) log("warning: " + warning);
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start;
  log(fmt::format("took          {:.1f} s", took.count()));
  fmt::print("{}\n", flags.output);
}

void check_files(const ImportFlags& flags) {
  check_map_name(flags.output);
  for (const std::string& input : flags.inputs) {
    if (flags.format.empty()) {
      require_kind(input, {InputKind::kCloud, InputKind::kMesh}, "a cloud or a mesh");
    }
  }
  std::vector<std::string> inputs = survey_inputs(flags.fit);
  inputs.insert(inputs.end(), flags.inputs.begin(), flags.inputs.end());
  check_outputs({flags.output, flags.outliers_out, flags.fit.ghosts_out}, inputs, flags.force);
}

/// What --reflectivity says of a map's intensities.
void calibrate(const ImportFlags& flags, MapDescription& description) {
  if (flags.reflectivity <= 0.0) return;
  if (!description.has_intensity) {
    throw InputError("--reflectivity: the points carry no intensity");
  }
  set_reflectivity(description, flags.reflectivity);
}

/// From scans with poses: their points make the map, or clouds that were made of them; their rays
/// fit it.
void import_survey(const ImportFlags& flags) {
  const auto start = std::chrono::steady_clock::now();
  if (flags.scale != 1.0 || !flags.shift.empty() || flags.up != "z") {
    throw InputError(
        "--scans: --scale, --shift and --up would part points from rays; use 'map "
        "transform' afterwards");
  }
  check_files(flags);
  OutputFile output(flags.output);
  auto ghosts = open_ghosts(flags.fit);
  std::optional<OutputFile> outliers;
  if (!flags.outliers_out.empty()) outliers.emplace(flags.outliers_out);
  const Executor executor(flags.threads);
  const Progress progress = interruptible_progress();
  const auto survey = open_survey(flags.fit, progress);
  check_signal(flags.fit, *survey);
  const ImportOptions options = import_options(flags);
  const auto sources = cloud_sources(flags.inputs, flags.format, options.scratch_folder, progress);
  SurveyPoints points;
  for (const CloudSource& source : sources) {
    if (source.is_mesh()) {
      throw InputError(source.name() + ": a mesh was not made of scans; import it without --scans");
    }
    points.names.push_back(source.name());
  }
  points.open = [&](std::size_t i) { return sources[i].open(); };
  SurveyMap made = map_survey(*survey,
                              points,
                              {options, fit_options(flags.fit), closing_options(flags.fit)},
                              executor,
                              progress);
  end_progress();
  calibrate(flags, made.map.description);
  EditOptions edit;
  edit.scratch_folder = options.scratch_folder;
  paint_by_signal(made.map, flags.fit, *survey, edit, executor, progress);
  OutputSet outputs;
  write_map(std::move(output), made.map.tree, made.map.description);
  if (outliers) {
    write_cloud_pcd(std::move(*outliers), made.outliers, made.imported.has_intensity);
  }
  write_ghosts(std::move(ghosts), made.fit);
  outputs.commit();
  print_report(made.imported, options);
  print_tried(made.tried, "what left out scans saw");
  print_closed(flags.fit, made.closed);
  print_fit(made.fit, made.after);
  print_end(flags, made.imported, start);
}

void import_map(const ImportFlags& flags) {
  const auto start = std::chrono::steady_clock::now();
  const ImportOptions options = import_options(flags);
  check_files(flags);
  std::optional<OutputFile> outliers;
  if (!flags.outliers_out.empty()) outliers.emplace(flags.outliers_out);
  OutputFile output(flags.output);  // first: a folder that is not there is said at once
  const Executor executor(flags.threads);
  const Progress progress = interruptible_progress();
  const std::vector<CloudSource> sources =
      cloud_sources(flags.inputs, flags.format, options.scratch_folder, progress);
  if (flags.reflectivity > 0.0) {
    const bool any = std::any_of(sources.begin(), sources.end(), [](const CloudSource& source) {
      if (source.is_mesh()) return false;
      const auto cloud = source.open();
      return cloud->has_intensity() || cloud->has_color();
    });
    if (!any) throw InputError("--reflectivity: the points carry no intensity");
  }
  CloudMap made = map_clouds(sources, options, executor, progress);
  ImportedMap& map = made.map;
  end_progress();
  calibrate(flags, map.description);
  OutputSet outputs;
  if (outliers) write_cloud_pcd(std::move(*outliers), map.outliers, map.report.has_intensity);
  write_map(std::move(output), map.tree, map.description);
  outputs.commit();
  print_report(map.report, options);
  print_tried(made.tried, "rays to left out points");
  print_end(flags, map.report, start);
}

/// How surfels are made of the points. Returns --reflectivity.
CLI::Option* add_quality_flags(CLI::App& app, ImportFlags& flags) {
  app.add_option(
         "--quality",
         flags.quality,
         "Quality of the search tree: normal is built three times faster; rays through foliage "
         "are 20 % slower")
      ->check(CLI::IsMember({"normal", "high"}))
      ->capture_default_str();
  app.add_option("--tau",
                 flags.tau,
                 "Coverage that makes a return, 0.3 (fewest holes) to 0.5 (sharpest edges); "
                 "default: by the density of the points")
      ->check(within(0.05, 1.0));
  app.add_flag("--keep-outliers",
               flags.keep_outliers,
               "No outlier removal (thin wires, very uneven clouds)");
  app.add_option("--outlier-neighbours",
                 flags.outlier_neighbours,
                 "Cells that a cell's distance is measured to")
      ->check(CLI::Range(1, 100))
      ->capture_default_str();
  app.add_option("--outlier-sigmas",
                 flags.outlier_sigmas,
                 "A cell goes if it is this many deviations farther than the mean")
      ->check(within(0.0, 1e6))
      ->capture_default_str();
  app.add_option("--export-outliers", flags.outliers_out, "Write the dropped cells as a PCD cloud");
  return app
      .add_option("--reflectivity",
                  flags.reflectivity,
                  "Reflectivity (0 to 1, at the laser's wavelength) per unit of the points' "
                  "intensity, where this is calibrated: 0.01 for percent")
      ->check(within(1e-9, 1e6));
}

}  // namespace

void add_import(CLI::App& parent) {
  auto* app = parent.add_subcommand(
      "import", "Make a .pfmap from clouds or meshes, or from scans with poses");
  auto flags = std::make_shared<ImportFlags>();
  app->add_option(
      "inputs",
      flags->inputs,
      "Clouds or meshes: " + known_cloud_formats() + "; -: a cloud from standard input");
  app->add_option("-o,--output", flags->output, "The .pfmap to write")->required();
  app->add_option(
      "--format",
      flags->format,
      "What the inputs are, whatever their names: pcd, ply, las, xyz, ...; without it by "
      "the name, standard input by its first bytes");
  app->add_option("--resolution",
                  flags->resolution,
                  "Voxel size r, m; without it the one of those tried whose map shows best what "
                  "was left out of it: points, or with --scans scans")
      ->check(within(1e-4, 1e4));
  app->add_option("--shift",
                  flags->shift,
                  "x,y,z to add, m, after --scale and --up: many planners want the ground at z = 0")
      ->delimiter(',')
      ->expected(3)
      ->check(within(-1e9, 1e9));
  app->add_option("--scale", flags->scale, "Metres per unit of the files")
      ->check(within(1e-9, 1e9))
      ->capture_default_str();
  app->add_option("--scratch",
                  flags->scratch,
                  "Folder for what does not fit in 2.5 GB of memory; without it that of the output")
      ->check(CLI::ExistingDirectory);
  app->add_option("--up", flags->up, "The files' up axis; y is turned to z")
      ->check(CLI::IsMember({"y", "z"}))
      ->capture_default_str();
  auto* reflectivity = add_quality_flags(*app, *flags);
  app->footer("Example: pointflight map import hall.pcd -o hall.pfmap --resolution 0.05");
  add_fit_flags(*app, flags->fit, false);
  reflectivity->excludes(app->get_option("--signal-of"));
  add_force_flag(*app, flags->force);
  app->add_option("--threads", flags->threads, "0: all cores")->check(CLI::Range(0, 1024));
  app->callback([flags] {
    if (!flags->fit.files.scans.empty()) {
      import_survey(*flags);
    } else if (flags->inputs.empty()) {
      throw InputError("map import: a cloud, or --scans is wanted");
    } else {
      import_map(*flags);
    }
  });
}

}  // namespace pointflight::apps
