#include "apps/ros_flags.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <filesystem>

#include "apps/cli.hpp"
#include "apps/flags.hpp"
#include "apps/modules.hpp"
#include "apps/terminal.hpp"
#include "pointflight/core/input_error.hpp"
#include "pointflight/core/locked_file.hpp"
#include "pointflight/core/mapped_file.hpp"
#include "pointflight/recording/mcap_writer.hpp"
#include "pointflight/recording/recording.hpp"
#include "pointflight/ros/common/ros_names.hpp"
#include "pointflight/view/foxglove_transport.hpp"

namespace pointflight::apps {
namespace {

namespace fs = std::filesystem;

constexpr double kEndless = 1e6;  // s

/// Of a flag or a scenario's key: "now", or seconds since 1970.
Duration epoch_from(const std::string& text, const std::string& location) {
  if (text == "now") {
    return std::chrono::duration_cast<Duration>(
        std::chrono::system_clock::now().time_since_epoch());
  }
  char* end = nullptr;
  const double seconds = std::strtod(text.c_str(), &end);
  // a stamp has 31 bits of seconds
  if (end == text.c_str() || *end != '\0' || !(seconds >= 0.0) || !(seconds < 2.1e9)) {
    throw InputError(
        fmt::format("{}: '{}'; 'now' or seconds since 1970, such as 1.7e9", location, text));
  }
  return from_seconds(seconds);
}

Duration epoch_of(const RosFlags& flags, const Scenario& scenario, const RosProfile& profile) {
  if (!flags.epoch.empty()) return epoch_from(flags.epoch, "--epoch");
  const std::string& own = ros_setup_of(scenario).epoch;
  if (!own.empty()) return epoch_from(own, scenario.location("ros.epoch"));
  // living nodes must not see time jump back after a restart; recordings by themselves and runs in
  // lockstep are the same each time
  const bool live = flags.is_live() && flags.lockstep <= 0.0;
  return live && profile.epoch == StampEpoch::kNow ? epoch_from("now", "") : kFixedEpoch;
}

/// The file that a scenario came from, or the scenario as a file.
std::string text_of(const Scenario& scenario) {
  if (scenario.path.empty()) return scenario_yaml(scenario);
  const MappedFile file(scenario.path);
  const auto bytes = file.bytes();
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

void check_twice(const std::vector<std::string>& paths) {
  for (std::size_t i = 0; i < paths.size(); ++i) {
    for (std::size_t k = 0; k < i; ++k) {
      if (!is_same_file(paths[k], paths[i])) continue;
      throw InputError(fmt::format("--record: {} is given twice", paths[i]));
    }
  }
}

}  // namespace

void add_ros_flags(CLI::App& app, RosFlags& flags) {
  app.add_flag("--ros1", flags.ros1, "Publish to ROS 1 and take commands from it, in real time");
  app.add_flag(
      "--ros2",
      flags.ros2,
      "Publish to ROS 2 and take commands from it, in real time; ROS 2 need not be installed");
  app.add_flag("--ros2-localhost", flags.localhost, "Let only this machine find the ROS 2 node");
  app.add_option(
      "--profile",
      flags.profile,
      "Topics, frames and message types: default, marsim, ego, livox, ... or a path (docs/ros.md)");
  app.add_option(
      "--epoch", flags.epoch, "Time stamp of the start of the run: 'now', or seconds since 1970");
  app.add_flag("--sim-time",
               flags.sim_time,
               "Send /clock whatever the profile: nodes with use_sim_time live on it, and the run "
               "may be slower than real time (--rate)");
  app.add_option("--node", flags.node, "Name of the ROS node")->capture_default_str();
  app.add_flag("--no-wait", flags.no_wait, "Fly even while there is no ROS 1 master yet");
  auto* stay = app.add_flag("--stay",
                            flags.stay,
                            "Hover when the mission is flown, until interrupted (the default with "
                            "ROS in real time, unless --lockstep or a duration is given)");
  app.add_flag("--no-stay", flags.no_stay, "End when the mission is flown")->excludes(stay);
  app.add_option(
         "--lockstep",
         flags.lockstep,
         "Pause the simulation after each scan until a command arrives, for at most this many "
         "seconds of wall-clock time")
      ->check(within(0.0, 3600.0));
  app.add_option("--record",
                 flags.records,
                 "Record all messages into FILE.mcap (ROS 2) or FILE.bag (ROS 1); may be repeated")
      ->type_name("FILE")
      ->expected(1)
      ->take_all();
  app.add_option("--compression", flags.compression, "Compression of recordings: zstd, lz4 or none")
      ->check(CLI::IsMember({"zstd", "lz4", "none"}))
      ->capture_default_str();
}

void RosPart::check() const {
  for (const auto& [flag, given] : {std::pair{"--lockstep", flags_.lockstep > 0.0},
                                    std::pair{"--stay", flags_.stay},
                                    std::pair{"--sim-time", flags_.sim_time},
                                    std::pair{"--no-wait", flags_.no_wait}}) {
    if (given && !flags_.is_live()) {
      throw InputError(fmt::format("{}: has no effect without --ros1, --ros2 or --view", flag));
    }
  }
  if (!flags_.profile.empty() && !flags_.any()) {
    throw InputError("--profile: has no effect without --ros1, --ros2, --view or --record");
  }
  if (!flags_.any()) return;
  const bool digit = flags_.node.find_first_of("0123456789") == 0;
  if (!is_ros_word(flags_.node) || digit) {
    throw InputError(fmt::format("--node: '{}'; letters, digits and _ only, and no digit at first",
                                 flags_.node));
  }
  check_twice(flags_.records);
}

bool RosPart::is_live(const Scenario& /*scenario*/) const {
  return flags_.is_live();
}

void RosPart::prepare(Scenario& scenario, double rate) {
  if (!flags_.any()) return;
  rate_ = rate;
  const RosProfile profile = profile_for(scenario, flags_.profile);
  scenario.output.odometry_rate = std::max(scenario.output.odometry_rate, odometry_rate(profile));
  const bool planned = std::any_of(
      scenario.vehicles.begin(), scenario.vehicles.end(), [](const VehicleSetup& vehicle) {
        return !vehicle.mission.waypoints.empty() || !vehicle.commands.empty();
      });
  if (!flags_.is_live()) return;
  const bool is_open = scenario.duration <= 0.0;
  const bool stays = rate > 0.0 && flags_.lockstep <= 0.0 && !flags_.no_stay;
  if (flags_.stay || (is_open && (stays || !planned))) scenario.duration = kEndless;
}

namespace {

std::unique_ptr<Outlet> open_recording(const RosFlags& flags,
                                       const std::string& path,
                                       const Scenario& scenario,
                                       Duration epoch) {
  const bool is_mcap = fs::path(path).extension() == ".mcap";
  if (!is_mcap && fs::path(path).extension() != ".bag") {
    throw InputError(fmt::format("--record: {}: give a name that ends in .mcap or .bag", path));
  }
  check_recording({path, flags.overwrite});
  if (is_mcap) {
    McapOptions options;
    options.compression = flags.compression;
    auto writer = std::make_unique<McapWriter>(path, options);
    writer->attach("scenario.yaml", "application/yaml", text_of(scenario), epoch.count());
    return std::make_unique<Recording>(path, std::move(writer));
  }
  const Ros1Module& ros1 = ros1_module();
  // rosbag itself knows of no locks
  const int lock = open_locked(path + ".active", path + ".active");
  // bags know no zstd
  const std::string compression = flags.compression == "zstd" ? "lz4" : flags.compression;
  return std::make_unique<Recording>(path, ros1.bag_writer(path, compression), lock);
}

/// A planner that keeps less free than the hull takes grazes what it flies by.
void warn_of_small_inflation(const Simulation& simulation, const RosProfile& profile) {
  if (profile.inflation <= 0.0) return;
  for (const std::size_t v : simulation.flying_here()) {
    const VehicleAgent& vehicle = simulation.vehicle(v);
    const double reach = half_extent(vehicle.hull()).head<2>().maxCoeff();
    if (reach <= profile.inflation) continue;
    log(fmt::format(
        "warning: the planner of profile {} keeps {:.3g} m from obstacles, the hull of {} "
        "reaches {:.2f} m: it will graze them; let it inflate by {:.2f} m or more, or "
        "fly a smaller vehicle (said once)",
        fs::path(profile.path).stem().string(),
        profile.inflation,
        vehicle.setup().name,
        reach,
        reach));
    return;
  }
}

/// ROS, recordings and the viewers of `view`, if any, with everything open. Throws InputError.
std::unique_ptr<RosLink> make_ros_link(const RosFlags& flags,
                                       double rate,
                                       const Simulation& simulation,
                                       const std::shared_ptr<LiveServer>& view) {
  if (!flags.any()) return nullptr;
  const Scenario& scenario = simulation.scenario();
  RosProfile profile = profile_for(scenario, flags.profile);
  if (flags.has_ros()) warn_of_small_inflation(simulation, profile);
  const SurfelMap& map = simulation.map();
  if (const auto note = note_of(
          map_frame_for(map.bounds_world(), profile), profile, simulation.scenario().map_name())) {
    log(*note);
  }
  if (flags.sim_time) add_clock(profile);
  RosLinkOptions options;
  options.needs_clock = flags.has_ros() && !has_clock(profile);
  options.epoch = epoch_of(flags, scenario, profile);
  options.waits = !flags.no_wait;
  options.lockstep = flags.lockstep > 0.0;
  options.log = [](const std::string& line) { log(line); };
  options.on_left_behind = leave_static_objects;
  const Duration epoch = options.epoch;
  const RunDescription run = describe_run(simulation);
  auto link = std::make_unique<RosLink>(run, profile, std::move(options));
  for (const std::string& path : flags.records) {
    link->add_recording(open_recording(flags, path, scenario, epoch));
  }
  TransportOptions transport;
  transport.node = flags.node;
  transport.log = [](const std::string& text) { log(text); };
  transport.localhost_only = flags.localhost;
  if (flags.ros2) transport.large_rate = large_rate(run, profile);
  // in lockstep nobody waits for a clock
  if (flags.lockstep <= 0.0) transport.run_rate = rate;
  if (flags.ros1) link->add_transport(ros1_module().transport(transport));
  if (flags.ros2) link->add_transport(ros2_module().transport(transport));
  if (view) link->add_transport(std::make_unique<FoxgloveTransport>(view));
  return link;
}

}  // namespace

void RosPart::connect(Simulation& simulation, RunLoop& loop) {
  if (!flags_.any()) return;
  server_ = start_viewing(flags_.view, simulation.shared_map());
  ros_ = make_ros_link(flags_, rate_, simulation, server_);
  ThreadedLink::Options options;
  if (!flags_.is_live()) options.hold = kFilesWait;
  loop.add(thread_.emplace(*ros_, options));
  if (!server_) return;
  view_ = std::make_unique<ViewLink>(server_, ros_->epoch());
  loop.add(*view_);
}

void RosPart::say_recordings() const {
  for (std::size_t i = 0; i < flags_.records.size(); ++i) {
    std::error_code error;
    const std::string& path = flags_.records[i];
    const auto size = fs::file_size(path, error);
    if (error || ros_->has_failed(i)) continue;  // it was said
    log(fmt::format("recorded {}, {:.1f} MB", path, 1e-6 * static_cast<double>(size)));
  }
}

void RosPart::report(const RunLoop& loop) const {
  if (!ros_ || !loop.has_started()) return;
  say_recordings();
  const ScanDelays& delays = loop.scan_delays();
  if (flags_.is_live() && delays.count() > 0) {
    log(fmt::format("scans were ready {:.1f} ms after their end (median), {:.1f} ms at p99",
                    1e3 * delays.below(0.5),
                    1e3 * delays.below(0.99)));
  }
  if (loop.unanswered() > 0) {
    log(fmt::format("{} scans had no command within {} s", loop.unanswered(), flags_.lockstep));
  }
}

bool RosPart::has_failed() const {
  for (std::size_t i = 0; ros_ && i < ros_->recordings(); ++i) {
    if (ros_->has_failed(i)) return true;
  }
  return false;
}

}  // namespace pointflight::apps
