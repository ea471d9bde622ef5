#include "apps/survey_fidelity.hpp"

#include <fmt/format.h>

#include <filesystem>

#include "apps/error_table.hpp"
#include "apps/flags.hpp"
#include "apps/survey_flags.hpp"
#include "apps/terminal.hpp"
#include "pointflight/fidelity/scene_beams.hpp"
#include "pointflight/fidelity/survey.hpp"
#include "pointflight/fidelity/survey_report.hpp"
#include "pointflight/fidelity/survey_way.hpp"
#include "pointflight/geometry/polyline.hpp"
#include "pointflight/io/pcd_writer.hpp"
#include "pointflight/lidar/lidar.hpp"
#include "pointflight/map/import/map_builder.hpp"
#include "pointflight/scenes/made_world.hpp"
#include "pointflight/survey/survey_map.hpp"

namespace pointflight::apps {
namespace {

constexpr ErrorTable kSurveyTable{.has_empty_rays = true};
constexpr const char* kJudge = "os1_32";

std::unique_ptr<CloudReader> surveyed_cloud(const Survey& survey, double thin) {
  auto cloud = cloud_of(rays_of(survey));
  return thin > 0.0 ? thinned(std::move(cloud), thin) : std::move(cloud);
}

SceneBeams beams_beside(const ExactScene& scene,
                        const SceneTree& tree,
                        const Survey& survey,
                        const SurveyFlags& flags,
                        const Executor& executor,
                        const Progress& progress) {
  const LidarSettings settings = load_lidar(kJudge);
  BeamPlan plan;
  plan.name = kJudge;
  plan.range_max = static_cast<float>(settings.range_max);
  for (const Beam& beam : Lidar(settings, 0).beams(0, executor)) {
    plan.directions_sensor.push_back(beam.direction_sensor);
  }
  plan.places = places_near(scene, tree, survey.walk, flags.places, flags.walk.seed);
  return cast_exactly(scene, plan, executor, progress);
}

void write_out(const ExactScene& scene,
               const Survey& survey,
               const SurveyFlags& flags,
               const Progress& progress) {
  const std::string folder = (std::filesystem::path(flags.out) / scene.name).string();
  write_survey(survey, folder, progress);
  std::vector<CloudPoint> points;
  const auto cloud = surveyed_cloud(survey, flags.thin);
  std::vector<CloudPoint> batch;
  while (cloud->read(batch)) points.insert(points.end(), batch.begin(), batch.end());
  write_cloud_pcd(OutputFile(folder + "/cloud.pcd"), points, false);
}

/// Rows of a report by the names that tables and JSON have for them.
std::vector<std::pair<std::string, const ErrorStatistics*>> rows_of(const SurveyReport& report) {
  return {{"all", &report.all},
          {"inside", &report.inside},
          {"edge", &report.edge},
          {"foliage", &report.foliage},
          {"never surveyed", &report.unseen},
          {"sky", &report.sky}};
}

void print_survey_report(const std::string& title, const SurveyReport& report) {
  fmt::print("{}\n", title);
  kSurveyTable.print_heading();
  for (const auto& [name, statistics] : rows_of(report)) {
    if (statistics->rays > 0) kSurveyTable.print_row(name, *statistics);
  }
  if (report.foliage.rays > 0) {
    fmt::print(
        "foliage: distributions of ranges in patches of 2 degrees lie {:.2f} m apart; those of "
        "true beams 0.1 degrees beside {:.2f} m\n",
        report.foliage_distance,
        report.foliage_distance_beside);
  }
  fmt::print("\n");
}

std::shared_ptr<const SurfelMap> bare_map(
    const std::string& name,
    const std::function<std::unique_ptr<CloudReader>()>& cloud,
    const ImportOptions& options,
    const Executor& executor,
    const Progress& progress) {
  const ImportedMap imported = build_map(
      {name}, [&](std::size_t) { return cloud(); }, options, executor, progress);
  return SurfelMap::from_bytes(map_bytes(imported.tree, imported.description), name);
}

/// Prints or appends what each renderer makes of a map.
void judge(const std::shared_ptr<const SurfelMap>& map,
           const ExactScene& scene,
           const SceneBeams& beams,
           const SeenSurfaces& seen,
           const SurveyFlags& flags,
           const OwnRays* own,
           const Executor& executor,
           nlohmann::ordered_json& cases) {
  for (const std::string& name : flags.renderers) {
    const SurveyReport report =
        measure_survey(scene, beams, seen, *make_renderer(name, Scene{map}), executor);
    end_progress();
    if (!flags.json) {
      const std::string thin = flags.thin > 0.0 ? fmt::format("thinned to {:.3g} m", flags.thin)
                                                : std::string("all points");
      print_survey_report(
          fmt::format("{} surveyed by {} for {:.4g} s, {}, map at {:.3g} m{}, {} "
                      "beams, {}",
                      scene.name,
                      flags.lidar,
                      flags.walk.seconds,
                      thin,
                      map->resolution(),
                      own == nullptr               ? ""
                      : map->notes().has_opacity() ? " fitted to its rays, with opacity"
                                                   : " fitted to its rays",
                      kJudge,
                      name),
          report);
    }
    if (!flags.json && own != nullptr && &name == &flags.renderers.back()) {
      fmt::print("survey's own rays, beam: {}\n\n", about_rays(*own));
    }
    nlohmann::ordered_json row = {{"scene", scene.name},
                                  {"survey",
                                   {{"lidar", flags.lidar},
                                    {"seconds", flags.walk.seconds},
                                    {"noise", flags.walk.noise},
                                    {"shake", flags.walk.shake},
                                    {"shake_deg", flags.walk.shake_deg},
                                    {"thin", flags.thin}}},
                                  {"fitted", own != nullptr},
                                  {"resolution", map->resolution()},
                                  {"beams", kJudge},
                                  {"renderer", name},
                                  {"tau", map->model().tau},
                                  {"seed", flags.walk.seed},
                                  {"surfels", map->surfel_count()}};
    for (const auto& [label, statistics] : rows_of(report)) {
      row[label] = kSurveyTable.json(*statistics);
    }
    row["foliage_distance"] = report.foliage_distance;
    row["foliage_distance_beside"] = report.foliage_distance_beside;
    if (own != nullptr) row["own_rays_right"] = own->right_share();
    cases.push_back(std::move(row));
  }
}

}  // namespace

void add_survey_flags(CLI::App& app, SurveyFlags& flags) {
  auto* survey = app.add_flag("--survey",
                              flags.on,
                              "Map what a LiDAR carried through the scene saw (--lidar, default "
                              "mid360), and judge it by an OS1-32 beside the way");
  const auto add = [&](const char* name, double& value, double max, const char* about) {
    app.add_option(name, value, about)
        ->check(within(0.0, max))
        ->capture_default_str()
        ->needs(survey);
  };
  app.add_option(
         "--seconds",
         flags.walk.seconds,
         "Duration of the simulated survey walk, s; in made-up worlds about: it goes everywhere")
      ->check(within(1.0, 3600.0))
      ->capture_default_str()
      ->needs(survey);
  add("--tilt", flags.walk.tilt_deg, 80.0, "Downward tilt of the carried LiDAR, degrees");
  add("--shake",
      flags.walk.shake,
      1.0,
      "Standard deviation of the error of each scan's estimated position, m");
  add("--shake-deg",
      flags.walk.shake_deg,
      10.0,
      "Standard deviation of the error of its estimated attitude, degrees");
  app.add_option("--thin", flags.thin, "Keep one point in each cube of this size, m; 0: all")
      ->check(within(0.0, 0.0) | within(1e-3, 10.0))
      ->capture_default_str()
      ->needs(survey);
  auto* fit =
      app.add_flag("--fit", flags.fit, "Also fit the map to the survey's rays, and judge that")
          ->needs(survey);
  app.add_flag("--opacity", flags.opacity, "Find out which surfels let beams through, too")
      ->needs(fit);
  app.add_option(
         "--survey-out", flags.out, "Folder for cloud.pcd, scans/, free/ and poses.tum of each")
      ->needs(survey);
}

void measure_surveyed(const ExactScene& scene,
                      const SurveyFlags& flags,
                      const Executor& executor,
                      const Progress& progress,
                      nlohmann::ordered_json& cases) {
  const SceneTree tree(scene);
  SurveyOptions walk = flags.walk;
  if (WorldKind::table().find(scene.name) != nullptr) {
    walk.way = plan_survey_way(scene, walk.seconds * walk.speed, executor);
    walk.seconds = length_of(walk.way) / walk.speed;
  }
  const Survey survey = make_survey(scene, tree, load_lidar(flags.lidar), walk, executor, progress);
  if (!flags.out.empty()) write_out(scene, survey, flags, progress);
  const SceneBeams beams = beams_beside(scene, tree, survey, flags, executor, progress);
  const SeenSurfaces seen = surfaces_of([&] { return rays_of(survey); });
  for (const auto& resolution : flags.resolutions) {
    ImportOptions options;
    options.resolution = resolution;
    options.tau = flags.tau;
    const auto cloud = [&] { return surveyed_cloud(survey, flags.thin); };
    const auto bare = bare_map(scene.name, cloud, options, executor, progress);
    judge(bare, scene, beams, seen, flags, nullptr, executor, cases);
    if (!flags.fit) continue;
    FitOptions fit;
    fit.opacity = flags.opacity;
    FitReport report;
    ClosingReport closed;
    const EditedMap fitted = fit_and_close(
        *bare,
        [&] { return rays_of(survey); },
        fit,
        ClosingOptions{},
        {},
        executor,
        report,
        closed,
        progress);
    const auto map = SurfelMap::from_bytes(map_bytes(fitted.tree, fitted.description), scene.name);
    const OwnRays own = measure_rays(
        *map, [&] { return rays_of(survey); }, FitOptions{}.right, {}, executor, progress);
    judge(map, scene, beams, seen, flags, &own, executor, cases);
  }
}

}  // namespace pointflight::apps
