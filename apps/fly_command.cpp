#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <cmath>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "apps/commands.hpp"
#include "apps/flags.hpp"
#include "apps/fly_links.hpp"
#include "apps/ros_flags.hpp"
#include "apps/scenario_command.hpp"
#include "apps/settings_json.hpp"
#include "apps/share_flags.hpp"
#include "apps/terminal.hpp"
#include "apps/view_flags.hpp"
#include "pointflight/core/input_error.hpp"
#include "pointflight/core/number_text.hpp"
#include "pointflight/core/output_file.hpp"
#include "pointflight/core/resources.hpp"
#include "pointflight/sim/ended_run.hpp"
#include "pointflight/sim/flight_recorder.hpp"
#include "pointflight/sim/scenario_maker.hpp"
#include "pointflight/sim/start_check.hpp"
#include "share/common_ground.hpp"
#include "view/view_link.hpp"

namespace pointflight::apps {
namespace {

namespace fs = std::filesystem;

struct FlyFlags {
  std::string input;
  std::string output;
  std::string rate;  ///< Empty: real time with ROS, else as fast as it goes.
  std::string map;   ///< Instead of the scenario's.
  std::int64_t seed = -1;
  std::string lidar;
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
  RosFlags ros;
  ViewFlags view;
  ShareFlags share;
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
  waypoints.reserve(words.size());
  for (const std::string& word : words) {
    waypoints.emplace_back(parse_numbers(word, 3, "--mission (x,y,z x,y,z ...)").data());
  }
  return waypoints;
}

/// A scenario made up for a map.
Scenario scenario_for_map(const FlyFlags& flags,
                          const std::optional<Aabb>& bounds,
                          const Executor& executor) {
  ScenarioWish wish;
  wish.map_path = flags.input;
  wish.map_key = flags.input;
  if (!flags.lidar.empty()) wish.lidar = flags.lidar;
  if (!flags.vehicle.empty()) wish.vehicle = flags.vehicle;
  if (!flags.start.empty()) wish.start = Vector3d(flags.start.data());
  wish.bounds = bounds;
  // with ROS somebody else will say where to fly
  wish.mission = !flags.ros.has_ros() && flags.mission.empty();
  if (wish.mission || !wish.start) log(fmt::format("looking for a way through {}", flags.input));
  Scenario scenario = make_scenario(wish, executor);
  scenario.path.clear();
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
  if (!flags.map.empty()) scenario.map = fs::absolute(flags.map).string();
  return scenario;
}

Scenario load_input(const FlyFlags& flags, const Executor& executor) {
  std::optional<Aabb> bounds;
  if (!flags.start_in.empty()) bounds = box_from(flags.start_in, "--start-in");
  const auto waypoints = waypoints_from(flags.mission);
  const bool is_map = fs::path(flags.input).extension() == ".pfmap";
  if (is_map && !flags.map.empty()) {
    throw InputError(fmt::format("--map: is for a scenario; {} is a map itself", flags.input));
  }
  Scenario scenario =
      is_map ? scenario_for_map(flags, bounds, executor) : scenario_from_file(flags);
  if (!waypoints.empty()) {
    scenario.vehicles.front().mission.waypoints = waypoints;
    scenario.vehicles.front().commands.clear();
  }
  if (flags.seed >= 0) scenario.seed = flags.seed;
  if (flags.duration >= 0.0) scenario.duration = flags.duration;
  if (flags.no_scans) scenario.output.scans = false;
  for (VehicleSetup& vehicle : scenario.vehicles) {
    for (LidarMount& mount : vehicle.lidars) mount.snapshot = mount.snapshot || flags.snapshot;
  }
  if (bounds) warn_of_starts_outside(scenario, *bounds);
  return scenario;
}

/// What is wrong with the folder is said before a long search; `RunFolder` says it for good.
void check_folder(const FlyFlags& flags) {
  std::error_code error;
  if (fs::exists(flags.output, error) && !fs::is_directory(flags.output, error)) {
    throw InputError(fmt::format("{}: is a file; give a folder with -o", flags.output));
  }
  if (!flags.force && fs::is_directory(flags.output, error) && !fs::is_empty(flags.output, error)) {
    throw InputError(
        fmt::format("{}: is not empty; choose another folder or give --force", flags.output));
  }
}

/// Which limits cut what was asked for, and for how long.
void print_limits(const VehicleSummary& s) {
  std::vector<std::string> reached;
  const auto add = [&](const char* what, Duration time) {
    if (time.count() > 0) reached.push_back(fmt::format("{} for {:.2f} s", what, to_seconds(time)));
  };
  add("speed", s.speed_limited);
  add("acceleration", s.acceleration_limited);
  add("tilt", s.tilt_limited);
  add("thrust", s.rotors_limited);
  if (reached.empty()) return;
  fmt::print("  limits reached    {}\n", fmt::join(reached, ", "));
}

void print_vehicle(const Simulation& simulation, std::size_t v) {
  const VehicleSummary& s = simulation.summary(v);
  const VehicleStatus& status = simulation.status(v);
  if (simulation.vehicle_count() > 1) fmt::print("{}\n", simulation.vehicle(v).setup().name);
  fmt::print("  flown             {:.1f} m, up to {:.2f} m/s{}\n",
             s.distance_flown,
             s.speed_max,
             status.crashed ? "; crashed" : "");
  fmt::print("  scans             {}, {} points of {} beams\n",
             s.scans,
             short_count(static_cast<double>(s.points)),
             short_count(static_cast<double>(s.beams)));
  fmt::print("  closest approach  {}\n",
             s.closest_approach ? fmt::format("{} m to {} at {}",
                                              fixed_text(*s.closest_approach, 2),
                                              label_name(simulation, s.closest_label),
                                              point_text(s.closest_place_world))
                                : std::string("over 10 m"));
  fmt::print("  collisions        {}\n", s.collisions);
  fmt::print("  tracking error    {:.0f} mm RMS, {:.0f} mm at most\n",
             s.tracking_error_rms * 1e3,
             s.tracking_error_max * 1e3);
  print_limits(s);
  if (simulation.vehicle(v).setup().battery) {
    fmt::print("  battery           {:.2f} Ah used, {:.1f} V now{}{}\n",
               status.battery.used,
               status.battery.voltage,
               s.battery_low ? fmt::format("; low at {:.1f} s", to_seconds(*s.battery_low)) : "",
               s.battery_empty
                   ? fmt::format("; rotors off at {:.1f} s", to_seconds(*s.battery_empty))
                   : "");
  }
  if (status.autopilot.rejected > 0) {
    fmt::print("  commands          {} rejected; the last: {}\n",
               status.autopilot.rejected,
               status.autopilot.last_rejection);
  }
}

void print_result(const FlyFlags& flags, const Simulation& simulation, double wall) {
  if (flags.json) {
    auto json = nlohmann::ordered_json::parse(summary_json(simulation));
    if (!flags.output.empty()) json["folder"] = flags.output;
    json["real_time_factor"] = to_seconds(simulation.simulated()) / wall;
    print_json(json);
    return;
  }
  fmt::print("{}\n", flags.output.empty() ? flags.input : flags.output);
  const std::string reason = reason_of(simulation.end());
  fmt::print("  end               {}, after {:.1f} s{}\n",
             to_string(simulation.end()),
             to_seconds(simulation.time()),
             reason.empty() ? "" : ": " + reason);
  for (const std::size_t v : simulation.flying_here()) print_vehicle(simulation, v);
  fmt::print("  real-time factor  {:.1f}\n", to_seconds(simulation.simulated()) / wall);
  if (flags.output.empty() || flags.no_picture) return;
  fmt::print("  picture           {}\n", (fs::path(flags.output) / "overview.png").string());
}

int exit_code_of(RunEnd end) {
  switch (end) {
    case RunEnd::kCompleted:
    case RunEnd::kIdle:
      return kDone;
    case RunEnd::kInterrupted:
      return kInterrupted;
    default:
      return kRanButFailed;
  }
}

/// How late scans left, what lockstep waited for in vain.
void say_waits(const RunLoop& loop, const RosFlags& ros) {
  const ScanDelays& delays = loop.scan_delays();
  if (ros.is_live() && delays.count() > 0) {
    log(fmt::format("scans left {:.1f} ms after their end (median), {:.1f} ms at p99",
                    1e3 * delays.below(0.5),
                    1e3 * delays.below(0.99)));
  }
  if (loop.unanswered() > 0) {
    log(fmt::format("{} scans had no command within {} s", loop.unanswered(), ros.lockstep));
  }
}

/// A process of a shared run that was killed goes on where its trajectory ends, if the scenario
/// says so.
void resume(const FlyFlags& flags, Simulation& simulation) {
  const bool wanted = share_setup_of(simulation.scenario()).on_return == OnReturn::kLog;
  if (!wanted || flags.output.empty()) return;
  const auto ended = ended_run(flags.output, simulation, simulation.flying_here());
  if (!ended) return;
  if (!was_run_of(ended->scenario, simulation)) {
    log(fmt::format(
        "{}: what an earlier run left there is of another scenario; begins at the start",
        flags.output));
    return;
  }
  simulation.resume_at(ended->time, ended->skipped, ended->states);
  log(fmt::format("{}: goes on where an earlier run's trajectories end, at {:.2f} s",
                  flags.output,
                  to_seconds(ended->time)));
}

int fly(const FlyFlags& flags) {
  if (flags.output.empty() && !flags.ros.any()) {
    throw InputError(
        "give a folder for the results with -o, or --view, --ros1, --ros2 or --record");
  }
  check_ros_flags(flags.ros);
  check_share_flags(flags.share);
  RunOptions options;
  if (!flags.rate.empty()) options.rate = parse_rate(flags.rate);
  options.lockstep = flags.ros.lockstep;
  options.log = [](const std::string& line) { log(line); };
  options.progress = terminal_progress();
  options.interrupted = interrupted;
  if (!flags.output.empty()) check_folder(flags);
  const Executor executor(flags.threads);
  Scenario scenario = load_input(flags, executor);
  // others live on the wall clock
  const bool in_real_time = flags.ros.is_live() || is_free(flags.share, scenario);
  if (flags.rate.empty()) options.rate = in_real_time ? 1.0 : 0.0;
  const auto map = scenario.open_map();
  prepare_for_ros(flags.ros, options.rate, scenario);
  Simulation simulation(scenario, map, executor);
  warn_about(scenario, *map);
  for (const std::string& warning : start_warnings(simulation, executor)) log(warning);

  RunLoop loop(simulation, options);
  std::optional<SharedRun> shared;
  if (flags.share.is_asked()) shared.emplace(flags.share, simulation, loop, options.rate);
  if (shared) {
    resume(flags, simulation);
    loop.add(shared->link());  // first: that it leaves is said before pictures are drawn
  }
  std::optional<FolderLink> folder;
  if (!flags.output.empty()) {
    const Existing existing = flags.force ? Existing::kReplace : Existing::kRefuse;
    folder.emplace(FolderOptions{flags.output, existing, !flags.no_picture},
                   simulation,
                   loop,
                   executor.threads());
    loop.add(*folder);
  }
  TerminalLink terminal(simulation);
  loop.add(terminal);
  catch_interrupts();
  const std::shared_ptr<LiveServer> server = start_viewing(flags.view, map);
  const std::unique_ptr<RosLink> ros = make_ros_link(flags.ros, simulation, server);
  if (ros) loop.add(*ros);
  std::optional<ViewLink> view;
  if (server) loop.add(view.emplace(server, ros->epoch()));
  const RunEnd end = loop.run();
  end_progress();
  const bool failed = ros && has_failed_recording(*ros);
  if (!loop.has_started()) return failed ? kWrongInput : kInterrupted;
  if (ros) say_recordings(flags.ros, *ros);
  say_waits(loop, flags.ros);
  if (shared) shared->say();
  print_result(flags, simulation, loop.wall_time());
  if (shared && !shared->fleet().fault().empty()) throw InputError(shared->fleet().fault());
  return failed ? kWrongInput : exit_code_of(end);
}

}  // namespace

void add_fly_command(CLI::App& parent, int& exit_code) {
  auto* app = parent.add_subcommand("fly", "Fly a scenario, or a map in a scenario made up for it");
  auto flags = std::make_shared<FlyFlags>();
  app->add_option("scenario", flags->input, "A scenario .yaml, or a .pfmap")->required();
  app->add_option(
      "-o,--output", flags->output, "Folder for the results; needed without ROS and --view");
  app->add_option("--seed", flags->seed, "Instead of the scenario's")
      ->check(CLI::Range(std::int64_t{0}, std::int64_t{9000000000000000}));
  app->add_option(
      "--rate",
      flags->rate,
      "Simulated seconds per second: 'max', or 1.0 for real time (the default with ROS)");
  app->add_option(
      "--map",
      flags->map,
      "Where the scenario's map lies now; one that a run was flown in must be the same");
  app->add_option("--lidar",
                  flags->lidar,
                  "A shipped sensor or a path; a scenario's vehicles carry it instead of theirs");
  app->add_option("--vehicle", flags->vehicle, "A shipped vehicle or a path, for all that fly");
  app->add_option("--mission", flags->mission, "Waypoints x,y,z x,y,z ... of the first vehicle, m")
      ->type_name("X,Y,Z ...");
  app->add_option("--duration", flags->duration, "s; 0: as long as the mission takes")
      ->check(within(0.0, 1e6));
  app->add_option("--start", flags->start, "x,y,z where the first vehicle starts, m")
      ->delimiter(',')
      ->expected(3)
      ->check(within(-1e7, 1e7));
  add_start_in_flag(*app, flags->start_in);
  app->add_option("--threads", flags->threads, "0: all cores; results never depend on it")
      ->check(CLI::Range(0, 1024));
  app->add_flag("--force",
                flags->force,
                "Write into a folder that is not empty: an earlier run's files go, others stay; "
                "and over recordings");
  app->add_flag("--no-scans", flags->no_scans, "Do not write scans as PCD");
  app->add_flag("--no-picture", flags->no_picture, "Do not draw overview.png; `picture` can later");
  app->add_flag("--json", flags->json, "summary.json on stdout, with the real-time factor");
  app->add_flag(
      "--snapshot", flags->snapshot, "All beams of a scan from one pose, as in the paper");
  add_ros_flags(*app, flags->ros);
  add_view_flags(*app, flags->view);
  add_share_flags(*app, flags->share);
  app->callback([flags, &exit_code] {
    flags->ros.overwrite = flags->force;
    flags->ros.view = flags->view.is_asked();
    exit_code = fly(*flags);
  });
}

}  // namespace pointflight::apps
