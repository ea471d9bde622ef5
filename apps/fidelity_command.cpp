#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>

#include "apps/cli.hpp"
#include "apps/commands.hpp"
#include "apps/error_table.hpp"
#include "apps/flags.hpp"
#include "apps/survey_fidelity.hpp"
#include "apps/terminal.hpp"
#include "pointflight/core/input_error.hpp"
#include "pointflight/fidelity/scene_beams.hpp"
#include "pointflight/lidar/lidar.hpp"
#include "pointflight/map/import/map_builder.hpp"
#include "pointflight/picture/error_picture.hpp"

namespace pointflight::apps {
namespace {

struct FidelityFlags {
  std::vector<std::string> scenes;
  std::vector<double> resolutions = {0.05};
  std::vector<double> noises = {0.0};
  double points_per_cell = 8.0;
  double density_min = 2000.0;
  bool thinned = false;
  std::string lidar;
  std::vector<std::string> renderers = {"beam"};
  double tau = 0.0;  ///< 0: by the density.
  std::size_t poses = 8;
  std::size_t beams = 20000;
  std::uint64_t seed = 1;
  bool json = false;
  std::string png;
  bool force = false;
  int threads = 0;
  SurveyFlags survey;
};

constexpr ErrorTable kTable{.has_empty_rays = true};

nlohmann::ordered_json to_json(const std::vector<FidelityRow>& rows) {
  nlohmann::ordered_json json = nlohmann::ordered_json::object();
  for (const FidelityRow& row : rows) json[row.name] = kTable.json(row.statistics);
  return json;
}

void print_fidelity(const FidelityReport& report) {
  kTable.print_heading();
  kTable.print_row("all", report.all);
  kTable.print_row("interior", report.interior);
  kTable.print_row("silhouette", report.silhouette);
  for (const auto* rows : {&report.by_incidence, &report.by_range, &report.by_tag}) {
    for (const FidelityRow& row : *rows) kTable.print_row(row.name, row.statistics);
  }
  fmt::print("\n");
}

/// The beams of --lidar, or what suits the scene.
BeamPlan plan_for(const ExactScene& scene, const FidelityFlags& flags, const Executor& executor) {
  BeamPlan plan;
  const bool small = make_small_scene(scene.name).has_value();
  if (flags.lidar.empty() && small) {
    plan.name = "aimed";
    plan.range_max = 100.0f;
  } else if (auto table = table_beams(flags.lidar.empty() ? "avia_grid" : flags.lidar)) {
    plan = *table;
  } else {
    const LidarSettings settings = load_lidar(flags.lidar);
    const Lidar lidar(settings, 0);
    plan.name = flags.lidar;
    plan.range_max = static_cast<float>(settings.range_max);
    for (const Beam& beam : lidar.beams(0, executor)) {
      plan.directions_sensor.push_back(beam.direction_sensor);
    }
  }
  plan.poses = flags.poses;
  plan.aimed_beams = flags.beams;
  plan.seed = flags.seed;
  return plan;
}

std::shared_ptr<const SurfelMap> import_scene(const ExactScene& scene,
                                              const SceneSampling& sampling,
                                              const FidelityFlags& flags,
                                              const Executor& executor,
                                              const Progress& progress) {
  ImportOptions options;
  options.resolution = sampling.resolution;
  if (flags.tau > 0.0) options.tau = static_cast<float>(flags.tau);
  const ImportedMap map = build_map(
      {scene.name},
      [&](std::size_t) { return sampled_cloud(scene, sampling); },
      options,
      executor,
      progress);
  return SurfelMap::from_bytes(map_bytes(map.tree, map.description), scene.name);
}

void draw_case(const SceneBeams& beams,
               const FidelityReport& report,
               const std::string& title,
               const std::string& path) {
  std::vector<picture::ErrorPanel> panels;
  const std::size_t count = beams.per_pose();
  for (std::size_t pose = 0; pose < std::min<std::size_t>(4, beams.poses.size()); ++pose) {
    const Pose& T_world_sensor = beams.poses[pose];
    const Vector3d& p = T_world_sensor.translation;
    picture::ErrorPanel panel{fmt::format("from {:.2f}, {:.2f}, {:.2f}", p.x(), p.y(), p.z()), {}};
    for (std::size_t i = pose * count; i < (pose + 1) * count; ++i) {
      const TrueBeam& beam = beams.beams[i];
      const Vector3d d =
          T_world_sensor.rotation.conjugate() * beam.ray.direction_world.cast<double>();
      panel.marks.push_back({static_cast<float>(std::atan2(d.y(), d.x())),
                             static_cast<float>(std::asin(std::clamp(d.z(), -1.0, 1.0))),
                             beam.range,
                             report.rendered[i]});
    }
    panels.push_back(std::move(panel));
  }
  picture::draw_errors(panels, title, path);
}

void run_scene(const ExactScene& scene,
               const FidelityFlags& flags,
               const Executor& executor,
               nlohmann::ordered_json& cases) {
  const Progress progress = interruptible_progress();
  const SceneBeams beams =
      cast_exactly(scene, plan_for(scene, flags, executor), executor, progress);
  for (const double resolution : flags.resolutions) {
    for (const double noise : flags.noises) {
      const SceneSampling sampling{
          flags.points_per_cell, resolution, flags.density_min, noise, flags.seed, flags.thinned};
      const auto map = import_scene(scene, sampling, flags, executor, progress);
      for (const std::string& name : flags.renderers) {
        const auto renderer = make_renderer(name, Scene{map});
        const FidelityReport report = measure_fidelity(scene, beams, *renderer, executor);
        end_progress();
        const std::string title = fmt::format("{} at {:.4g} m, noise {:.4g} mm, {} beams, {}",
                                              scene.name,
                                              resolution,
                                              1e3 * noise,
                                              beams.plan.name,
                                              name);
        if (!flags.json) {
          fmt::print("{}\n", title);
          print_fidelity(report);
        }
        cases.push_back({{"scene", scene.name},
                         {"resolution", resolution},
                         {"noise", noise},
                         {"points_per_cell", flags.points_per_cell},
                         {"thinned", flags.thinned},
                         {"beams", beams.plan.name},
                         {"renderer", name},
                         {"tau", map->model().tau},
                         {"seed", flags.seed},
                         {"surfels", map->surfel_count()},
                         {"all", kTable.json(report.all)},
                         {"interior", kTable.json(report.interior)},
                         {"silhouette", kTable.json(report.silhouette)},
                         {"by_incidence", to_json(report.by_incidence)},
                         {"by_range", to_json(report.by_range)},
                         {"by_kind", to_json(report.by_tag)}});
        if (flags.png.empty()) continue;
        draw_case(beams,
                  report,
                  title,
                  fmt::format("{}/{}_{:.4g}_{:.4g}mm_{}.png",
                              flags.png,
                              scene.name,
                              resolution,
                              1e3 * noise,
                              name));
      }
    }
  }
}

/// What both kinds share, if it was given; defaults differ.
void complete_survey_flags(const CLI::App& app, FidelityFlags& flags) {
  const auto was_given = [&](const char* name) { return app.count(name) > 0; };
  for (const char* name : {"--points-per-cell", "--density-min", "--thinned", "--beams", "--png"}) {
    if (was_given(name)) {
      throw InputError(fmt::format("{} means nothing to --survey; leave one of them out", name));
    }
  }
  SurveyFlags& survey = flags.survey;
  if (flags.noises.size() > 1) {
    throw InputError("--noise: a survey takes one value, that of its ranges");
  }
  if (was_given("--noise")) survey.walk.noise = flags.noises.front();
  if (was_given("--lidar")) survey.lidar = flags.lidar;
  if (was_given("--poses")) survey.places = flags.poses;
  if (flags.tau > 0.0) survey.tau = static_cast<float>(flags.tau);
  survey.resolutions = {std::nullopt};
  if (was_given("--resolution")) {
    survey.resolutions.assign(flags.resolutions.begin(), flags.resolutions.end());
  }
  survey.renderers = flags.renderers;
  survey.walk.seed = flags.seed;
  survey.json = flags.json;
}

void fidelity(const FidelityFlags& flags) {
  const Executor executor(flags.threads);
  const PictureFolder survey(flags.survey.out, flags.force);
  const PictureFolder pictures(flags.png, flags.force);
  std::vector<ExactScene> scenes;
  for (const std::string& name : flags.scenes) scenes.push_back(load_scene(name));
  for (std::size_t i = 1; i < scenes.size() && !flags.survey.out.empty(); ++i) {
    const auto same = [&](const ExactScene& other) { return other.name == scenes[i].name; };
    if (std::none_of(scenes.begin(), scenes.begin() + static_cast<std::ptrdiff_t>(i), same))
      continue;
    throw InputError(fmt::format("--survey-out: two scenes are named '{}'", scenes[i].name));
  }
  nlohmann::ordered_json cases = nlohmann::ordered_json::array();
  for (const ExactScene& scene : scenes) {
    if (flags.survey.on) {
      measure_surveyed(scene, flags.survey, executor, interruptible_progress(), cases);
    } else {
      run_scene(scene, flags, executor, cases);
    }
  }
  if (flags.json) {
    fmt::print("{}\n",
               nlohmann::ordered_json{{"cases", cases}}.dump(
                   2, ' ', false, nlohmann::json::error_handler_t::replace));
  }
}

std::string scene_help() {
  std::string text = "Scenes (or a CSV of shapes):";
  for (const auto& [name, about] : scene_names()) {
    text += fmt::format("\n  {:<14} {}", name, about);
  }
  return text;
}

}  // namespace

void add_fidelity_command(CLI::App& parent, int& /*exit_code*/) {
  auto* app = parent.add_subcommand(
      "fidelity", "Sample scenes with exact ranges to clouds, import, render, compare");
  auto flags = std::make_shared<FidelityFlags>();
  app->add_option("scenes", flags->scenes, "What to measure (default: all)");
  app->add_option("--resolution", flags->resolutions, "Of the maps, m; several: 0.05,0.2")
      ->delimiter(',')
      ->check(within(1e-3, 10.0))
      ->capture_default_str();
  app->add_option("--noise", flags->noises, "Of the clouds along the normals, m; several: 0,0.01")
      ->delimiter(',')
      ->check(within(0.0, 1.0))
      ->capture_default_str();
  app->add_option("--points-per-cell", flags->points_per_cell, "Points a square of the resolution")
      ->check(within(0.01, 1000.0))
      ->capture_default_str();
  app->add_option("--density-min", flags->density_min, "At least so many points per square metre")
      ->check(within(0.0, 1e6))
      ->capture_default_str();
  app->add_flag("--thinned",
                flags->thinned,
                "Keep one point of each cube of the resolution, as maps are often thinned");
  app->add_option("--lidar",
                  flags->lidar,
                  "avia_grid, mid360_uniform, vlp32_grid, a shipped sensor or a .yaml (default: "
                  "avia_grid in large scenes, beams aimed at what matters in small ones)");
  app->add_option(
         "--renderer", flags->renderers, "Renderers to compare, separated by commas: beam,paper")
      ->delimiter(',')
      ->check(CLI::IsMember(renderer_names()))
      ->capture_default_str();
  app->add_option("--tau", flags->tau, "Coverage that makes a return (default: by the density)")
      ->check(within(0.05, 1.0));
  app->add_option("--poses",
                  flags->poses,
                  "Number of random sensor poses, for scenes that have none of their own")
      ->check(CLI::Range(1, 100000))
      ->capture_default_str();
  app->add_option(
         "--beams", flags->beams, "Number of beams per pose that are aimed at edges and surfaces")
      ->check(CLI::Range(1, 100000000))
      ->capture_default_str();
  app->add_option("--seed", flags->seed, "Seed of clouds, poses and aimed beams")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  app->add_flag("--json", flags->json, "JSON on stdout");
  app->add_option("--png", flags->png, "Folder for pictures of the errors");
  add_survey_flags(*app, flags->survey);
  add_force_flag(*app, flags->force);
  app->add_option("--threads", flags->threads, "0: all cores")->check(CLI::Range(0, 1024));
  app->footer(scene_help());
  app->callback([flags, app] {
    if (flags->survey.on) complete_survey_flags(*app, *flags);
    if (flags->scenes.empty()) {
      for (const auto& [name, about] : scene_names()) {
        if (!flags->survey.on || !make_small_scene(name)) flags->scenes.push_back(name);
      }
    }
    fidelity(*flags);
  });
}

}  // namespace pointflight::apps
