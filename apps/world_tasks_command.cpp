#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "apps/commands.hpp"
#include "apps/flags.hpp"
#include "apps/terminal.hpp"
#include "apps/world_flags.hpp"
#include "pointflight/core/constants.hpp"
#include "pointflight/core/input_error.hpp"
#include "pointflight/core/math.hpp"
#include "pointflight/core/number_text.hpp"
#include "pointflight/core/output_file.hpp"
#include "pointflight/picture/pictures.hpp"
#include "pointflight/scenes/world_tasks.hpp"
#include "pointflight/sim/scenario.hpp"

namespace pointflight::apps {
namespace {

using Json = nlohmann::ordered_json;

struct TaskFlags {
  WorldMapOptions made;
  std::vector<std::string> chosen;        ///< --set
  double radius = SpaceOptions{}.radius;  ///< m
  int count = 3;                          ///< Of each difficulty.
  std::string scenarios;                  ///< Folder; empty: none are written.
  std::string png;
  bool json = false;
  bool force = false;
};

constexpr double kNarrow = 1.5;  // m: nobody flies fast through such passages

/// Tasks with names: "easy_1".
struct NamedTask {
  std::string name;
  WorldTask task;
};

std::vector<NamedTask> named(const std::vector<WorldTask>& tasks) {
  std::vector<NamedTask> all;
  int number = 0;
  for (const WorldTask& task : tasks) {
    number = all.empty() || task.difficulty != all.back().task.difficulty ? 1 : number + 1;
    all.push_back({fmt::format("{}_{}", name_of(task.difficulty), number), task});
  }
  return all;
}

double rounded(double value) {
  return std::round(value * 1000.0) / 1000.0;
}

Json json_of(const Vector3d& p) {
  return {rounded(p.x()), rounded(p.y()), rounded(p.z())};
}

Json json_of(const NamedTask& named) {
  const WorldTask& task = named.task;
  Json json{{"name", named.name},
            {"difficulty", name_of(task.difficulty)},
            {"start", json_of(task.start)},
            {"goal", json_of(task.goal)},
            {"straight", rounded(task.straight)},
            {"length", rounded(task.length)},
            {"passage", rounded(task.passage)},
            {"way", Json::array()}};
  for (const Vector3d& p : task.way) json["way"].push_back(json_of(p));
  return json;
}

Json json_of(const ExactScene& scene, const SceneSpace& space) {
  return {{"min", json_of(scene.free.min)},
          {"max", json_of(scene.free.max)},
          {"volume", rounded(space.reachable_volume())},
          {"flyable", rounded(space.flyable_share())}};
}

void print_tasks(const ExactScene& scene,
                 const SceneSpace& space,
                 const std::vector<NamedTask>& tasks) {
  fmt::print("explore: {:.0f} m^3 can be reached between {} and {}; over {:.0f} % of the floors\n",
             space.reachable_volume(),
             point_text(scene.free.min, 1),
             point_text(scene.free.max, 1),
             100.0 * space.flyable_share());
  fmt::print("{:<9} {:>22} {:>22} {:>9} {:>9} {:>9}\n",
             "task",
             "start",
             "goal",
             "straight",
             "shortest",
             "passage");
  for (const NamedTask& named : tasks) {
    const WorldTask& task = named.task;
    fmt::print("{:<9} {:>22} {:>22} {:>7.1f} m {:>7.1f} m {:>7.1f} m\n",
               named.name,
               point_text(task.start, 2),
               point_text(task.goal, 2),
               task.straight,
               task.length,
               task.passage);
  }
}

/// The first vehicle from the start along a free way to the goal.
Scenario scenario_of(const WorldTask& task, const WorldMapOptions& made) {
  Scenario scenario;
  scenario.world = made;
  scenario.is_short = true;
  VehicleSetup& vehicle = scenario.vehicles.front();
  const auto as_written = [](const Vector3d& p) {
    return Vector3d(rounded(p.x()), rounded(p.y()), rounded(p.z()));
  };
  vehicle.start = as_written(task.start);
  for (std::size_t i = 1; i < task.way.size(); ++i) {
    vehicle.mission.waypoints.push_back(as_written(task.way[i]));
  }
  // a Mid-360 alone is blind for what lies below
  LidarMount down;
  down.position = {0, 0, -0.1};
  down.rotation_rpy_deg = {180, 0, 0};
  vehicle.lidars = {LidarMount{}, down};
  if (task.passage < kNarrow) vehicle.mission.motion.speed = 1.0;
  const Vector3d first = task.way[1] - task.start;
  vehicle.start_yaw_deg = std::round(math::atan2(first.y(), first.x()) / kDegree);
  return scenario;
}

void write_scenarios(const std::vector<NamedTask>& tasks, const TaskFlags& flags) {
  std::vector<std::string> paths;
  for (const NamedTask& named : tasks) {
    paths.push_back(fmt::format("{}/{}.yaml", flags.scenarios, named.name));
  }
  check_outputs(paths, {}, flags.force);
  std::error_code error;
  std::filesystem::create_directories(flags.scenarios, error);
  if (error) throw InputError(fmt::format("{}: {}", flags.scenarios, error.message()));
  OutputSet set;
  for (std::size_t i = 0; i < tasks.size(); ++i) {
    const WorldTask& task = tasks[i].task;
    OutputFile file(paths[i]);
    file.write(
        fmt::format("# {} of {}, {:.1f} m, through a passage of {:.1f} m. The waypoints are a "
                    "free way, and\n"
                    "# the last one is the goal: planners look at that alone.\n",
                    tasks[i].name,
                    name_of(flags.made),
                    task.length,
                    task.passage));
    file.write(scenario_yaml(scenario_of(task, flags.made)));
    file.commit();
  }
  set.commit();
}

picture::Color color_of(Difficulty difficulty) {
  switch (difficulty) {
    case Difficulty::kEasy:
      return {0.10, 0.60, 0.25};
    case Difficulty::kMedium:
      return {0.95, 0.55, 0.10};
    case Difficulty::kHard:
      return {0.85, 0.10, 0.15};
  }
  return picture::kInk;
}

void draw_tasks(const std::vector<NamedTask>& tasks, const TaskFlags& flags) {
  std::vector<picture::MapWay> ways;
  for (const NamedTask& named : tasks) {
    ways.push_back({named.task.way, named.name, color_of(named.task.difficulty)});
  }
  const auto map = open_world_map(flags.made, Executor(), interruptible_progress());
  end_progress();
  picture::draw_map(*map, name_of(flags.made), flags.png, ways);
}

void find_tasks(TaskFlags& flags) {
  read_chosen(flags.chosen, flags.made.world);
  check_outputs({flags.png}, {}, flags.force);
  const ExactScene scene = make_world(flags.made.world);
  SpaceOptions options;
  options.radius = flags.radius;
  const Progress progress = interruptible_progress();
  progress("looking for free space", 0.0);
  const SceneSpace space(scene, options, Executor());
  progress("looking for ways", 0.3);
  const auto tasks =
      named(make_tasks(space, flags.made.world.seed, static_cast<std::size_t>(flags.count)));
  end_progress();
  if (!flags.scenarios.empty()) write_scenarios(tasks, flags);
  if (!flags.png.empty()) draw_tasks(tasks, flags);
  if (!flags.json) {
    print_tasks(scene, space, tasks);
    return;
  }
  Json json{{"world", flags.made.world.name},
            {"seed", flags.made.world.seed},
            {"radius", flags.radius},
            {"explore", json_of(scene, space)},
            {"tasks", Json::array()}};
  for (const NamedTask& one : tasks) json["tasks"].push_back(json_of(one));
  fmt::print("{}\n", json.dump(2));
}

}  // namespace

void add_world_tasks_command(CLI::App& world) {
  auto* app = world.add_subcommand(
      "tasks", "Where to fly in a world: starts and goals of three difficulties, free volume");
  auto flags = std::make_shared<TaskFlags>();
  add_world_options(*app, flags->made.world, flags->chosen);
  app->add_option("--count", flags->count, "Of each difficulty")
      ->check(CLI::Range(1, 40))
      ->capture_default_str();
  app->add_option("--radius",
                  flags->radius,
                  "Of what flies, m, with 0.09 m for the grid; shipped vehicles have 0.26 or less")
      ->check(within(0.05, 1.0))
      ->capture_default_str();
  app->add_option(
      "--scenarios", flags->scenarios, "A folder for a scenario of each: easy_1.yaml, ...");
  app->add_option("--png", flags->png, "A picture: free ways from above");
  app->add_option("--resolution", flags->made.resolution, "Of the scenarios' and picture's map, m")
      ->check(within(0.02, 1.0))
      ->capture_default_str();
  app->add_flag("--json", flags->json, "JSON on stdout, with free ways");
  add_force_flag(*app, flags->force);
  app->footer("Example: pointflight world tasks street --scenarios tasks");
  app->callback([flags] { find_tasks(*flags); });
}

}  // namespace pointflight::apps
