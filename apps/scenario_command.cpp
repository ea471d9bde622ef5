#include "apps/scenario_command.hpp"

#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>

#include "apps/cli.hpp"
#include "apps/commands.hpp"
#include "apps/flags.hpp"
#include "apps/input_kind.hpp"
#include "apps/named_map.hpp"
#include "apps/settings_json.hpp"
#include "apps/terminal.hpp"
#include "pointflight/core/input_error.hpp"
#include "pointflight/core/number_text.hpp"
#include "pointflight/core/output_file.hpp"
#include "pointflight/core/resources.hpp"
#include "pointflight/ros/common/output.hpp"
#include "pointflight/ros/common/profile.hpp"
#include "pointflight/sim/scenario_maker.hpp"
#include "pointflight/sim/simulation.hpp"
#include "pointflight/sim/start_check.hpp"
#include "pointflight/world/clearance.hpp"

namespace pointflight::apps {
namespace {

namespace fs = std::filesystem;

struct NewFlags {
  std::string map;
  std::string output;
  std::string lidar = "mid360";
  std::string vehicle = "quad_330";
  double length = 60.0;
  double speed = 2.0;
  std::vector<double> start_in;
  bool force = false;
};

void new_scenario(const NewFlags& flags) {
  require_kind(flags.map, {InputKind::kMap}, "a map (.pfmap)");
  const Executor executor;
  check_outputs({flags.output}, {flags.map, flags.lidar, flags.vehicle}, flags.force);
  ScenarioRequest wish;
  wish.map = open_named_map(flags.map);
  wish.world = world_in(flags.map);
  if (!wish.world) wish.map_key = path_in_file(flags.output, flags.map);
  wish.lidar = flags.lidar;
  wish.vehicle = flags.vehicle;
  wish.length = flags.length;
  wish.speed = flags.speed;
  if (!flags.start_in.empty()) wish.bounds = box_from(flags.start_in, "--start-in");
  MadeScenario made = make_scenario(wish, executor);
  for (const std::string& note : made.notes) log("note: " + note);
  Scenario& scenario = made.scenario;
  VehicleSetup& vehicle = scenario.vehicles.front();
  for (std::string* model : {&vehicle.lidars.front().model, &vehicle.model}) {
    if (is_model_path(*model)) *model = path_in_file(flags.output, *model);
  }
  OutputFile file(flags.output);
  file.write(
      "# A pointflight scenario; every key: docs/scenario.md, or pointflight scenario keys\n" +
      scenario_yaml(scenario));
  file.commit();
  const Mission mission(vehicle.start, 0.0, vehicle.mission);
  log(fmt::format("{} waypoints, {:.0f} m; fly it: pointflight fly {} -o run",
                  vehicle.mission.waypoints.size(),
                  mission.length(),
                  flags.output));
  fmt::print("{}\n", flags.output);
}

nlohmann::ordered_json json_of(const std::string& path, const Simulation& simulation) {
  nlohmann::ordered_json json;
  json["file"] = path;
  json["duration"] = to_seconds(simulation.end_time());
  json["obstacles"] = simulation.obstacle_count();
  json["vehicles"] = nlohmann::ordered_json::array();
  for (std::size_t v = 0; v < simulation.vehicle_count(); ++v) {
    const VehicleAgent& agent = simulation.vehicle(v);
    json["vehicles"].push_back({{"name", agent.setup().name},
                                {"model", agent.setup().model},
                                {"lidars", agent.lidars().size()},
                                {"waypoints", agent.setup().mission.waypoints.size()},
                                {"mission_length", agent.mission().length()}});
  }
  return json;
}

void print_scenario(const std::string& path, const Simulation& simulation) {
  fmt::print("{}: ready: {:.1f} s\n", path, to_seconds(simulation.end_time()));
  for (std::size_t v = 0; v < simulation.vehicle_count(); ++v) {
    const VehicleAgent& agent = simulation.vehicle(v);
    fmt::print("  {}: {} with {} lidar{}, {} waypoints, {:.1f} m\n",
               agent.setup().name,
               agent.setup().model,
               agent.lidars().size(),
               agent.lidars().size() == 1 ? "" : "s",
               agent.setup().mission.waypoints.size(),
               agent.mission().length());
  }
  if (simulation.obstacle_count() > 0) fmt::print("  {} obstacles\n", simulation.obstacle_count());
}

void check_scenario(const std::string& path, bool as_json) {
  require_kind(path, {InputKind::kYaml}, "a scenario (.yaml)");
  const Scenario scenario = load_scenario(path);
  const auto map = open_map_of(scenario);
  const Executor executor;
  const Simulation simulation(scenario, map, executor);
  // whatever --ros1, --ros2 and --record will ask for
  RosRun ros{.run = describe_run(simulation), .profile = profile_for(scenario)};
  output_streams(ros);
  warn_about(scenario, *map);
  for (const std::string& warning : start_warnings(simulation, executor)) log(warning);
  for (std::size_t v = 0; v < simulation.vehicle_count(); ++v) {
    for (const std::string& line : simulation.vehicle(v).foreseen()) log("warning: " + line);
  }
  if (as_json) {
    print_json(json_of(path, simulation));
  } else {
    print_scenario(path, simulation);
  }
}

}  // namespace

void warn_about(const Scenario& scenario, const SurfelMap& map) {
  const auto fleet = scenario.fleet();
  for (std::size_t v = 0; v < fleet.size(); ++v) {
    const VehicleSetup& setup = fleet[v];
    const double radius = bounding_radius(load_vehicle(setup.model, scenario.folder()).hull());
    Vector3d from = setup.start;
    for (std::size_t i = 0; i < setup.mission.waypoints.size(); ++i) {
      const Vector3d& to = setup.mission.waypoints[i];
      const double free = clearance_along(map, from, to, radius, 1.0);
      if (free <= 0.0) {
        const std::string key = scenario.vehicle_key(v, fmt::format("mission.waypoints[{}]", i));
        log(fmt::format(
            "{}: warning: {}'s leg to waypoint {} passes through the map; a collision is "
            "likely",
            scenario.location(key),
            setup.name,
            i + 1));
      }
      from = to;
    }
  }
}

void warn_of_starts_outside(const Scenario& scenario, const Aabb& box) {
  const auto fleet = scenario.fleet();
  for (std::size_t v = 0; v < fleet.size(); ++v) {
    const Vector3d& p = fleet[v].start;
    if ((p - box.min).minCoeff() >= 0.0 && (box.max - p).minCoeff() >= 0.0) continue;
    log(
        fmt::format("{}: warning: {} starts at ({:.2f}, {:.2f}, {:.2f}), which is not between {}: "
                    "the planner has no map there (--start-in)",
                    scenario.location(scenario.vehicle_key(v, "start")),
                    fleet[v].name,
                    p.x(),
                    p.y(),
                    p.z(),
                    box_text(box)));
  }
}

void add_scenario_command(CLI::App& parent, int& /*exit_code*/) {
  auto* app = parent.add_subcommand("scenario", "Make and check scenario files");
  app->require_subcommand(1);
  auto* make = app->add_subcommand("new", "A commented scenario with a free start and waypoints");
  auto flags = std::make_shared<NewFlags>();
  make->add_option("map", flags->map, "A .pfmap, or a made-up world: street:7")->required();
  make->add_option("-o,--output", flags->output, "The .yaml to write")->required();
  make->add_option("--lidar", flags->lidar, "A shipped sensor")->capture_default_str();
  make->add_option("--vehicle", flags->vehicle, "A shipped vehicle")->capture_default_str();
  make->add_option("--length", flags->length, "Of the mission, where the map allows, m")
      ->check(within(1.0, 1e5))
      ->capture_default_str();
  make->add_option("--speed", flags->speed, "m/s")->check(within(0.1, 30.0))->capture_default_str();
  add_start_in_flag(*make, flags->start_in);
  add_force_flag(*make, flags->force);
  make->callback([flags] { new_scenario(*flags); });

  auto* check = app->add_subcommand("check", "Read a scenario and say whether it can be flown");
  auto path = std::make_shared<std::string>();
  check->add_option("scenario", *path, "A .yaml")->required();
  auto as_json = std::make_shared<bool>(false);
  check->add_flag("--json", *as_json, "JSON on stdout");
  check->callback([path, as_json] { check_scenario(*path, *as_json); });

  auto* keys = app->add_subcommand("keys", "All keys as a Markdown table (docs/scenario.md)");
  keys->callback([] {
    fmt::print("| key | unit | default | range | meaning |\n| --- | --- | --- | --- | --- |\n{}",
               scenario_reference());
  });
}

}  // namespace pointflight::apps
