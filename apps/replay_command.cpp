#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <limits>
#include <memory>
#include <nlohmann/json.hpp>

#include "apps/cli.hpp"
#include "apps/commands.hpp"
#include "apps/flags.hpp"
#include "apps/fly_links.hpp"
#include "apps/fly_report.hpp"
#include "apps/named_map.hpp"
#include "apps/renderer_flags.hpp"
#include "apps/ros_flags.hpp"
#include "apps/settings_json.hpp"
#include "apps/terminal.hpp"
#include "pointflight/core/constants.hpp"
#include "pointflight/core/input_error.hpp"
#include "pointflight/core/output_file.hpp"
#include "pointflight/flight_log/log_comparison.hpp"
#include "pointflight/flight_log/log_source.hpp"
#include "pointflight/geometry/rotation.hpp"
#include "pointflight/picture/pictures.hpp"
#include "pointflight/sim/scenario_maker.hpp"

namespace pointflight::apps {
namespace {

struct ReplayFlags {
  std::string log;
  std::string map;  ///< Empty: the outputs are flown, nothing is seen.
  std::string vehicle;
  std::string lidar = "mid360";
  std::vector<double> origin;  ///< x, y, z, heading in degrees, of the log's frame in the map.
  double window = 0.5;
  double from = 0.0;
  double until = std::numeric_limits<double>::infinity();
  std::string output;
  std::string png;
  std::string csv;
  bool json = false;
  bool force = false;
  bool no_scans = false;
  int threads = 0;
  RendererFlags renderer;
  RosFlags ros;
};

void write_csv(const LogComparison& comparison, const std::string& path) {
  OutputFile file(path);
  file.write(
      "time,in_window,logged_gx,logged_gy,logged_gz,logged_ax,logged_ay,logged_az,"
      "flown_gx,flown_gy,flown_gz,flown_ax,flown_ay,flown_az,tilt_error,turn_error,speed_error\n");
  for (const ComparedSample& s : comparison.samples) {
    std::string line = fmt::format("{:.6f},{:.6f}", s.time, s.in_window);
    for (const Vector3d& v : {s.logged.gyro, s.logged.accel, s.flown.gyro, s.flown.accel}) {
      line += fmt::format(",{:.7g},{:.7g},{:.7g}", v.x(), v.y(), v.z());
    }
    file.write(line +
               fmt::format(",{:.7g},{:.7g},{:.7g}\n", s.tilt_error, s.turn_error, s.speed_error));
  }
  file.commit();
}

nlohmann::ordered_json json_of(const FlightLog& log, const LogComparison& c, double window) {
  const auto vector = [](const Vector3d& v) { return nlohmann::ordered_json{v.x(), v.y(), v.z()}; };
  nlohmann::ordered_json json;
  json["log"] = log.path;
  json["firmware"] = log.firmware;
  json["window"] = window;
  json["windows"] = c.windows;
  json["samples"] = c.samples.size();
  json["accel_rms"] = vector(c.accel_rms);
  json["gyro_rms"] = vector(c.gyro_rms);
  json["tilt_rms_deg"] = c.tilt_rms / kDegree;
  json["turn_rms_deg"] = c.turn_rms / kDegree;
  json["speed_rms"] = c.speed_rms;
  return json;
}

void print_comparison(const FlightLog& log,
                      const VehicleSettings& vehicle,
                      const LogComparison& c,
                      double window) {
  fmt::print("{}: {}, outputs ({}) at {:.0f} Hz, IMU at {:.0f} Hz, {} gaps or senseless messages\n",
             log.path,
             log.firmware,
             log.outputs_from,
             rate_of(log.outputs),
             rate_of(log.imu),
             log.skipped);
  fmt::print("{} by the logged outputs, put where the log has it {} times, {:g} s each; rms:\n",
             vehicle.title,
             c.windows,
             window);
  fmt::print("  specific force   {:.3f} {:.3f} {:.3f} m/s^2 (ahead, left, up)\n",
             c.accel_rms.x(),
             c.accel_rms.y(),
             c.accel_rms.z());
  fmt::print("  rates            {:.4f} {:.4f} {:.4f} rad/s (roll, pitch, yaw)\n",
             c.gyro_rms.x(),
             c.gyro_rms.y(),
             c.gyro_rms.z());
  fmt::print("  after {:g} s      tilt {:.2f} deg, attitude {:.2f} deg, velocity {:.3f} m/s\n",
             window,
             c.tilt_rms / kDegree,
             c.turn_rms / kDegree,
             c.speed_rms);
}

void compare_outputs(const ReplayFlags& flags,
                     const FlightLog& log,
                     const VehicleSettings& vehicle) {
  const LogComparison comparison =
      fly_outputs(log, vehicle, {flags.window, flags.from, flags.until, terminal_progress()});
  end_progress();
  if (!flags.csv.empty()) write_csv(comparison, flags.csv);
  if (!flags.png.empty()) {
    picture::draw_log_comparison(log, vehicle, comparison, flags.window, flags.png);
  }
  if (flags.json && !flags.map.empty()) return;  // what is seen along the way is the one document
  if (flags.json) {
    print_json(json_of(log, comparison, flags.window));
  } else {
    print_comparison(log, vehicle, comparison, flags.window);
  }
}

Pose map_from_log(const ReplayFlags& flags) {
  if (flags.origin.empty()) return {};
  const double heading = flags.origin.size() > 3 ? kDegree * flags.origin[3] : 0.0;
  return {quaternion_from_rpy(0.0, 0.0, heading),
          {flags.origin[0], flags.origin[1], flags.origin[2]}};
}

/// A scenario of so long with the vehicle where the log has it at first.
Scenario scenario_along(const ReplayFlags& flags,
                        const std::shared_ptr<const SurfelMap>& map,
                        const SourcedState& first,
                        double duration,
                        const Executor& executor) {
  ScenarioRequest wish;
  wish.map = map;
  wish.world = world_in(flags.map);
  if (!wish.world) wish.map_key = flags.map;
  wish.lidar = flags.lidar;
  wish.vehicle = flags.vehicle;
  wish.start = first.body.p_world;
  wish.mission = false;
  MadeScenario made = make_scenario(wish, executor);
  for (const std::string& note : made.notes) log(fmt::format("note: {}", note));
  made.scenario.vehicles.front().mission.waypoints.clear();
  made.scenario.duration = duration;
  made.scenario.unfinished = Unfinished::kTimeUp;
  made.scenario.output.scans = !flags.no_scans;
  return made.scenario;
}

int follow_way(const ReplayFlags& flags, const FlightLog& log, const VehicleSettings& vehicle) {
  const Executor executor(flags.threads);
  const FlownTime flown = flown_time(log, vehicle);
  const double from = std::max(flags.from, flown.from);
  const double until = std::min(flags.until, flown.until);
  if (!(until > from))
    throw InputError(fmt::format("{}: nothing is flown from {:g} s on", log.path, from));
  const auto source = std::make_shared<LogSource>(log, from, map_from_log(flags));
  std::vector<std::unique_ptr<FlightPart>> parts;
  parts.push_back(std::make_unique<RendererPart>(flags.renderer));
  parts.push_back(std::make_unique<FolderPart>(
      FolderOptions{flags.output, flags.force ? Existing::kReplace : Existing::kRefuse, true},
      executor.threads()));
  parts.push_back(std::make_unique<TerminalPart>());
  parts.push_back(std::make_unique<RosPart>(flags.ros));
  for (const auto& part : parts) part->check();
  const auto map = open_named_map(flags.map);
  Scenario scenario =
      scenario_along(flags, map, *source->state_at(SimTime{}), until - from, executor);
  RunOptions options;
  options.rate =
      std::any_of(parts.begin(), parts.end(), [&](auto& p) { return p->is_live(scenario); }) ? 1.0
                                                                                             : 0.0;
  options.log = [](const std::string& line) { apps::log(line); };
  options.progress = terminal_progress();
  options.interrupted = interrupted;
  for (const auto& part : parts) part->prepare(scenario, options.rate);
  Simulation simulation(scenario, map, executor);
  simulation.follow(0, source);
  RunLoop loop(simulation, options);
  const auto connected = std::move(parts);  // their threads end before loop and simulation do
  catch_interrupts();
  for (const auto& part : connected) part->connect(simulation, loop);
  const RunEnd end = loop.run();
  end_progress();
  for (const auto& part : connected) part->report(loop);
  print_result({flags.log, flags.output, true, flags.json}, simulation, loop);
  return end == RunEnd::kInterrupted ? kInterrupted : kDone;
}

int replay(const ReplayFlags& flags) {
  const bool follows = !flags.map.empty();
  if (follows && flags.output.empty() && !flags.ros.any()) {
    throw InputError("give a folder for the scans with -o, or --view, --ros1, --ros2 or --record");
  }
  if (!follows && (!flags.output.empty() || !flags.origin.empty() || flags.ros.any())) {
    throw InputError(
        "without a map nothing is seen: -o, --origin, --record and the like have no effect");
  }
  const VehicleSettings vehicle = load_vehicle(flags.vehicle);
  check_outputs({flags.png, flags.csv}, {flags.log, vehicle.path}, flags.force);
  const FlightLog log = read_flight_log(flags.log);
  if (!follows || !flags.png.empty() || !flags.csv.empty()) compare_outputs(flags, log, vehicle);
  return follows ? follow_way(flags, log, vehicle) : kDone;
}

}  // namespace

void add_replay_command(CLI::App& parent, int& exit_code) {
  auto* app = parent.add_subcommand("replay",
                                    "A log of PX4 or ArduPilot: how true a vehicle file is to it, "
                                    "and what LiDARs would have seen");
  auto flags = std::make_shared<ReplayFlags>();
  app->add_option("log", flags->log, "A ULog (.ulg) or DataFlash (.bin) log")->required();
  app->add_option("map",
                  flags->map,
                  "A .pfmap or a made-up world: the logged way is followed in it, and scanned");
  app->add_option(
         "--vehicle", flags->vehicle, "Flies the logged outputs: a shipped vehicle or a path")
      ->required();
  app->add_option("--window",
                  flags->window,
                  "The vehicle is put where the log has it after so long, s, again and again")
      ->check(within(0.02, 60.0));
  app->add_option("--origin",
                  flags->origin,
                  "x,y,z[,heading in degrees] of the log's own origin in the map, m")
      ->delimiter(',')
      ->expected(3, 4)
      ->check(within(-1e7, 1e7));
  app->add_option("--lidar", flags->lidar, "Along the way: a shipped sensor or a path");
  app->add_option("--from", flags->from, "Part of the log, s of its own time")
      ->check(within(0.0, 1e7));
  app->add_option("--until", flags->until, "The same")->check(within(0.0, 1e7));
  app->add_option("-o,--output", flags->output, "Folder for the scans along the way");
  app->add_option("--png", flags->png, "Draw the logged IMU beside the flown one");
  app->add_option("--csv", flags->csv, "The same as a table");
  app->add_option("--threads", flags->threads, "0: all cores; results never depend on it")
      ->check(CLI::Range(0, 1024));
  app->add_flag("--no-scans", flags->no_scans, "Do not write scans as PCD");
  app->add_flag("--json", flags->json, "JSON on stdout");
  add_force_flag(*app, flags->force);
  add_renderer_flags(*app, flags->renderer, "Of the LiDAR");
  add_ros_flags(*app, flags->ros);
  add_view_flags(*app, flags->ros.view);
  app->footer("Example: pointflight replay flight.ulg --vehicle x500 --png truth.png");
  app->callback([flags, &exit_code] {
    flags->ros.overwrite = flags->force;
    exit_code = replay(*flags);
  });
}

}  // namespace pointflight::apps
