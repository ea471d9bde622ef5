#include "apps/world_survey.hpp"

#include <fmt/format.h>

#include <utility>

#include "apps/flags.hpp"
#include "apps/terminal.hpp"
#include "pointflight/fidelity/survey.hpp"
#include "pointflight/fidelity/survey_way.hpp"
#include "pointflight/geometry/polyline.hpp"
#include "pointflight/survey/survey_map.hpp"

namespace pointflight::apps {

void add_world_survey_flags(CLI::App& app, WorldSurveyFlags& flags) {
  auto* survey =
      app.add_flag("--survey",
                   flags.on,
                   "The map of what a LiDAR saw that was carried through the world: with "
                   "noise, shadows and holes");
  app.add_option("--lidar", flags.lidar, "That is carried: a shipped sensor or a .yaml")
      ->needs(survey)
      ->capture_default_str();
  app.add_option("--walk", flags.length, "About how long a way it is carried, m")
      ->check(within(10.0, 2000.0))
      ->needs(survey)
      ->capture_default_str();
  app.add_option("--speed", flags.speed, "At which it is carried, m/s")
      ->check(within(0.1, 20.0))
      ->needs(survey)
      ->capture_default_str();
  app.add_option("--drift", flags.drift, "Error of its estimated positions halfway, m")
      ->check(within(0.0, 1.0))
      ->needs(survey)
      ->capture_default_str();
  app.add_option("--scans",
                 flags.scans,
                 "Folder for its scans and poses.tum, as `map import --scans` reads them")
      ->needs(survey);
}

EditedMap survey_world(const WorldOptions& options,
                       const WorldSurveyFlags& flags,
                       std::optional<double> resolution,
                       const Executor& executor,
                       const Progress& progress) {
  const ExactScene scene = make_world(options);
  const LidarSettings lidar = load_lidar(flags.lidar);
  SurveyOptions walk;
  walk.seed = options.seed;
  walk.speed = flags.speed;
  walk.drift = flags.drift;
  report(progress, "planning the way", 0.0);
  walk.way = plan_survey_way(scene, flags.length, executor);
  walk.seconds = length_of(walk.way) / walk.speed;
  const SceneTree tree(scene);
  const Survey survey = make_survey(scene, tree, lidar, walk, executor, progress);
  if (!flags.scans.empty()) write_survey(survey, flags.scans, progress);
  SurveyMapOptions making;
  making.import.resolution = resolution;
  const auto scans = scans_of(survey);
  SurveyMap made = map_survey(*scans, {}, making, executor, progress);
  end_progress();
  log(fmt::format("{} scans along {:.0f} m; of the survey's rays {:.1f} % are right in the map",
                  survey.scans.size(),
                  length_of(walk.way),
                  100.0 * made.after.right_share()));
  return std::move(made.map);
}

}  // namespace pointflight::apps
