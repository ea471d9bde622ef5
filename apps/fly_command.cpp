#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>
#include <optional>

#include "apps/cli.hpp"
#include "apps/commands.hpp"
#include "apps/flags.hpp"
#include "apps/fly_links.hpp"
#include "apps/fly_report.hpp"
#include "apps/input_kind.hpp"
#include "apps/named_map.hpp"
#include "apps/policy_flags.hpp"
#include "apps/renderer_flags.hpp"
#include "apps/ros_flags.hpp"
#include "apps/scenario_command.hpp"
#include "apps/share_flags.hpp"
#include "apps/sitl_flags.hpp"
#include "apps/terminal.hpp"
#include "apps/view_flags.hpp"
#include "pointflight/core/input_error.hpp"
#include "pointflight/core/number_text.hpp"
#include "pointflight/core/resources.hpp"
#include "pointflight/sim/flight_recorder.hpp"
#include "pointflight/sim/scenario_maker.hpp"
#include "pointflight/sim/start_check.hpp"

namespace pointflight::apps {
namespace {

namespace fs = std::filesystem;
using MapPointer = std::shared_ptr<const SurfelMap>;

struct FlyFlags {
  std::string input;
  std::string output;
  std::string rate;  ///< Empty: real time with ROS, else as fast as it goes.
  std::string map;   ///< Instead of the scenario's.
  std::int64_t seed = -1;
  std::string lidar;
  std::string fidelity;  ///< Of all LiDARs' beams; empty: as each says.
  std::string vehicle;
  std::vector<double> start;         ///< x, y, z
  std::vector<double> start_in;      ///< A box.
  std::vector<std::string> mission;  ///< "x,y,z" each.
  double duration = -1.0;            ///< s
  int threads = 0;
  bool force = false;
  bool snapshot = false;
  bool no_scans = false;
  bool no_picture = false;
  bool json = false;
  std::string policy;  ///< Path of a .npz; empty: none.
  RendererFlags renderer;
  RosFlags ros;
  ShareFlags share;
  SitlFlags sitl;
};

double parse_rate(const std::string& text) {
  if (text == "max") return 0.0;
  char* end = nullptr;
  const double rate = std::strtod(text.c_str(), &end);
  if (end == text.c_str() || *end != '\0' || !(rate > 0.0) || !(rate <= 1000.0)) {
    throw InputError(fmt::format("--rate: '{}'; 'max' or a number such as 1.0", text));
  }
  return rate;
}

std::vector<Vector3d> waypoints_from(const std::vector<std::string>& words) {
  std::vector<Vector3d> waypoints;
  for (const std::string& word : words) {
    waypoints.emplace_back(parse_numbers(word, 3, "--mission", "x,y,z x,y,z ... in metres").data());
  }
  return waypoints;
}

/// A scenario made up for a map, which is opened.
Scenario scenario_for_map(const FlyFlags& flags,
                          MapPointer& map,
                          const std::optional<Aabb>& bounds,
                          const Executor& executor) {
  ScenarioRequest wish;
  wish.map = map = open_named_map(flags.input);
  wish.world = world_in(flags.input);
  if (!wish.world) wish.map_key = flags.input;
  if (!flags.lidar.empty()) wish.lidar = flags.lidar;
  if (!flags.vehicle.empty()) wish.vehicle = flags.vehicle;
  if (!flags.start.empty()) wish.start = Vector3d(flags.start.data());
  wish.bounds = bounds;
  // with ROS somebody else will say where to fly
  wish.mission = !flags.ros.has_ros() && flags.mission.empty();
  if (wish.mission || !wish.start) log(fmt::format("looking for a way through {}", flags.input));
  MadeScenario made = make_scenario(wish, executor);
  for (const std::string& note : made.notes) log("note: " + note);
  Scenario scenario = std::move(made.scenario);
  if (!wish.mission) scenario.vehicles.front().mission.waypoints.clear();
  return scenario;
}

/// A scenario file with what the command line says instead.
Scenario scenario_from_file(const FlyFlags& flags) {
  Scenario scenario = load_scenario(flags.input);
  if (!flags.start.empty()) scenario.vehicles.front().start = Vector3d(flags.start.data());
  for (VehicleSetup& vehicle : scenario.vehicles) {
    // relative to where the command is given, not to the scenario's folder
    const auto from_here = [](const std::string& model) {
      return is_model_path(model) ? fs::absolute(model).string() : model;
    };
    if (!flags.vehicle.empty()) vehicle.model = from_here(flags.vehicle);
    if (flags.lidar.empty()) continue;
    vehicle.lidars.resize(1);  // where the first one sits
    vehicle.lidars.front().model = from_here(flags.lidar);
  }
  if (!flags.map.empty()) {
    scenario.map = fs::absolute(flags.map).string();
    scenario.world.reset();
  }
  return scenario;
}

/// What to fly; `map` is set if it had to be opened for that.
Scenario load_input(const FlyFlags& flags, MapPointer& map, const Executor& executor) {
  std::optional<Aabb> bounds;
  if (!flags.start_in.empty()) bounds = box_from(flags.start_in, "--start-in");
  const auto waypoints = waypoints_from(flags.mission);
  const bool is_map = fs::path(flags.input).extension() == ".pfmap" || world_in(flags.input);
  if (is_map && !flags.map.empty()) {
    throw InputError(fmt::format("--map: is for a scenario; {} is a map itself", flags.input));
  }
  Scenario scenario =
      is_map ? scenario_for_map(flags, map, bounds, executor) : scenario_from_file(flags);
  if (!waypoints.empty()) {
    scenario.vehicles.front().mission.waypoints = waypoints;
    scenario.vehicles.front().commands.clear();
  }
  if (flags.seed >= 0) scenario.seed = flags.seed;
  if (flags.duration >= 0.0) {
    scenario.duration = flags.duration;
    scenario.unfinished = Unfinished::kTimeUp;  // so long was asked for
  }
  if (flags.no_scans) scenario.output.scans = false;
  for (VehicleSetup& vehicle : scenario.vehicles) {
    for (LidarMount& mount : vehicle.lidars) {
      mount.snapshot = mount.snapshot || flags.snapshot;
      if (!flags.fidelity.empty()) mount.sub_rays = flags.fidelity == "line" ? 1 : 0;
    }
  }
  if (bounds) warn_of_starts_outside(scenario, *bounds);
  return scenario;
}

int exit_code_of(RunEnd end) {
  switch (end) {
    case RunEnd::kCompleted:
    case RunEnd::kTimeUp:
    case RunEnd::kIdle:
      return kDone;
    case RunEnd::kInterrupted:
      return kInterrupted;
    default:
      return kRanButFailed;
  }
}

/// Whom the flight is for, in the order in which they get its samples and are closed: what other
/// processes hear of its end does not wait until a picture is drawn.
std::vector<std::unique_ptr<FlightPart>> parts_of(const FlyFlags& flags, int threads) {
  const Existing existing = flags.force ? Existing::kReplace : Existing::kRefuse;
  std::vector<std::unique_ptr<FlightPart>> parts;
  parts.push_back(std::make_unique<SharePart>(flags.share, flags.output));
  parts.push_back(std::make_unique<PolicyPart>(flags.policy));
  parts.push_back(std::make_unique<SitlPart>(flags.sitl, flags.output));
  parts.push_back(std::make_unique<RendererPart>(flags.renderer));
  parts.push_back(std::make_unique<FolderPart>(
      FolderOptions{flags.output, existing, !flags.no_picture}, threads));
  parts.push_back(std::make_unique<TerminalPart>());
  parts.push_back(std::make_unique<RosPart>(flags.ros));
  return parts;
}

RunOptions run_options(const FlyFlags& flags) {
  RunOptions options;
  if (!flags.rate.empty()) options.rate = parse_rate(flags.rate);
  options.lockstep = flags.ros.lockstep;
  options.log = [](const std::string& line) { log(line); };
  options.progress = terminal_progress();
  options.interrupted = interrupted;
  return options;
}

void say_warnings(const Simulation& simulation, const Executor& executor) {
  warn_about(simulation.scenario(), simulation.map());
  for (const std::string& warning : start_warnings(simulation, executor)) log(warning);
}

int fly(const FlyFlags& flags) {
  require_kind(
      flags.input, {InputKind::kYaml, InputKind::kMap}, "a scenario (.yaml) or a map (.pfmap)");
  if (flags.output.empty() && !flags.ros.any()) {
    throw InputError(
        "give a folder for the results with -o, or --view, --ros1, --ros2 or --record");
  }
  if (!flags.policy.empty() && (flags.sitl.px4 || flags.sitl.ardupilot)) {
    throw InputError(
        "--policy: a firmware flies the vehicles; it and a policy would both command them");
  }
  RunOptions options = run_options(flags);
  const Executor executor(flags.threads);
  auto parts = parts_of(flags, executor.threads());
  for (const auto& part : parts) part->check();
  MapPointer map;
  Scenario scenario = load_input(flags, map, executor);
  const bool is_live =
      std::any_of(parts.begin(), parts.end(), [&](auto& part) { return part->is_live(scenario); });
  if (flags.rate.empty()) options.rate = is_live ? 1.0 : 0.0;
  for (const auto& part : parts) {
    part->prepare(scenario, options.rate);
    options.lockstep = std::max(options.lockstep, part->lockstep());
  }
  if (!map) map = open_map_of(scenario);
  for (const auto& part : parts) part->place(scenario, map);
  Simulation simulation(scenario, map, executor);
  say_warnings(simulation, executor);

  RunLoop loop(simulation, options);
  const auto connected = std::move(parts);  // their threads end before loop and simulation do
  catch_interrupts();
  for (const auto& part : connected) part->connect(simulation, loop);
  const RunEnd end = loop.run();
  end_progress();
  for (const auto& part : connected) part->report(loop);
  const bool has_failed = std::any_of(
      connected.begin(), connected.end(), [](auto& part) { return part->has_failed(); });
  if (loop.has_started()) {
    print_result({flags.input, flags.output, !flags.no_picture, flags.json}, simulation, loop);
  }
  if (has_failed) return kWrongInput;
  return loop.has_started() ? exit_code_of(end) : kInterrupted;
}

}  // namespace

void add_fly_command(CLI::App& parent, int& exit_code) {
  auto* app = parent.add_subcommand("fly", "Fly a scenario, or a map with a generated scenario");
  auto flags = std::make_shared<FlyFlags>();
  app->add_option(
         "scenario", flags->input, "A scenario .yaml, a .pfmap, or a made-up world: street:7")
      ->required();
  app->add_option(
      "-o,--output", flags->output, "Folder for the results; needed without ROS and --view");
  app->add_option("--seed", flags->seed, "Seed of everything random, instead of the scenario's")
      ->check(CLI::Range(std::int64_t{0}, std::int64_t{9000000000000000}));
  app->add_option("--rate",
                  flags->rate,
                  "Simulated seconds per wall-clock second: 'max', or 1.0 for real time (the "
                  "default with ROS)");
  app->add_option("--map",
                  flags->map,
                  "Use this .pfmap instead of the scenario's path; must be the same map if the "
                  "scenario has its hash");
  app->add_option("--lidar",
                  flags->lidar,
                  "LiDAR of all vehicles, instead of the scenario's: a shipped sensor or a path");
  app->add_option("--fidelity",
                  flags->fidelity,
                  "Beams of all LiDARs, instead of what scenario and sensor files say: 'wide' as "
                  "they are, or 'line' without a width, at about half of the cost")
      ->check(CLI::IsMember({"line", "wide"}));
  app->add_option("--vehicle",
                  flags->vehicle,
                  "Model of all vehicles, instead of the scenario's: a shipped vehicle or a path");
  app->add_option("--mission", flags->mission, "Waypoints x,y,z x,y,z ... of the first vehicle, m")
      ->type_name("X,Y,Z ...");
  app->add_option(
         "--duration",
         flags->duration,
         "Length of the flight, s, whatever of its mission is left; 0: as long as that takes")
      ->check(within(0.0, 1e6));
  app->add_option("--start", flags->start, "x,y,z where the first vehicle starts, m")
      ->delimiter(',')
      ->expected(3)
      ->check(within(-1e7, 1e7));
  add_start_in_flag(*app, flags->start_in);
  app->add_option("--threads", flags->threads, "0: all cores; results never depend on it")
      ->check(CLI::Range(0, 1024));
  app->add_flag(
      "--force",
      flags->force,
      "Replace an earlier run in the output folder (other files there stay) and recordings "
      "of the same name");
  app->add_flag("--no-scans", flags->no_scans, "Do not write scans as PCD");
  app->add_flag("--no-picture", flags->no_picture, "Do not draw overview.png; `picture` can later");
  app->add_flag("--json", flags->json, "summary.json on stdout, with the real-time factor");
  app->add_flag(
      "--snapshot",
      flags->snapshot,
      "Take all beams of a scan from one pose, without motion distortion, as in the paper");
  app->footer("Example: pointflight fly forest.pfmap -o run --record run.mcap");
  add_policy_flag(*app, flags->policy);
  add_renderer_flags(*app, flags->renderer, "Of all LiDARs, instead of the scenario's");
  add_ros_flags(*app, flags->ros);
  add_view_flags(*app, flags->ros.view);
  add_share_flags(*app, flags->share);
  add_sitl_flags(*app, flags->sitl);
  app->callback([flags, &exit_code] {
    flags->ros.overwrite = flags->force;
    exit_code = fly(*flags);
  });
}

}  // namespace pointflight::apps
