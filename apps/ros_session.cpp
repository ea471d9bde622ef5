#include "apps/ros_session.hpp"

#include <fmt/format.h>

#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <algorithm>
#include <chrono>
#include <filesystem>

#include "apps/terminal.hpp"
#include "pointflight/core/input_error.hpp"
#include "pointflight/core/mapped_file.hpp"
#include "recording/mcap_writer.hpp"

namespace pointflight::apps {
namespace {

namespace fs = std::filesystem;

/// Some ROS programs misread times near zero: runs start here unless told otherwise.
constexpr Duration kFixedEpoch = std::chrono::seconds(1'700'000'000);

bool is_on(const RosFlags& flags) {
  return !flags.records.empty();
}

/// Of a flag or a scenario's key: "now", or seconds since 1970.
Duration epoch_from(const std::string& text, const std::string& place) {
  if (text == "now") {
    return std::chrono::duration_cast<Duration>(
        std::chrono::system_clock::now().time_since_epoch());
  }
  char* end = nullptr;
  const double seconds = std::strtod(text.c_str(), &end);
  // a stamp has 31 bits of seconds
  if (end == text.c_str() || *end != '\0' || !(seconds >= 0.0) || !(seconds < 2.1e9)) {
    throw InputError(
        fmt::format("{}: '{}'; 'now' or seconds since 1970, such as 1.7e9", place, text));
  }
  return from_seconds(seconds);
}

Duration epoch_of(const RosFlags& flags, const Scenario& scenario, const RosProfile& profile) {
  if (!flags.epoch.empty()) return epoch_from(flags.epoch, "--epoch");
  if (!scenario.ros.epoch.empty()) {
    return epoch_from(scenario.ros.epoch, scenario.place("ros.epoch"));
  }
  // recordings by themselves are the same each time
  const bool live = false;
  return live && profile.epoch == "now" ? epoch_from("now", "") : kFixedEpoch;
}

}  // namespace

void add_ros_flags(CLI::App& app, RosFlags& flags) {
  app.add_option("--record",
                 flags.records,
                 "Record all messages into FILE.mcap (as ROS 2); may be given again")
      ->type_name("FILE")
      ->expected(1)
      ->take_all();
  app.add_option("--compression", flags.compression, "Of recordings: zstd, lz4 or none")
      ->check(CLI::IsMember({"zstd", "lz4", "none"}))
      ->capture_default_str();
  app.add_option("--profile",
                 flags.profile,
                 "Names of messages: default, marsim, ego, livox, ... or a path (docs/ros.md)");
  app.add_option("--epoch", flags.epoch, "Stamps start 'now', or at seconds since 1970");
}

void prepare_for_ros(const RosFlags& flags, Scenario& scenario) {
  if (!is_on(flags)) return;
  const RosProfile profile = profile_for(scenario, flags.profile);
  scenario.output.odometry_rate =
      std::max(scenario.output.odometry_rate, RosBridge::odometry_rate(profile));
}

RosSession::RosSession(const RosFlags& flags, const Simulation& simulation) {
  if (!is_on(flags)) return;
  const Scenario& scenario = simulation.scenario();
  const RosProfile profile = profile_for(scenario, flags.profile);
  const Duration epoch = epoch_of(flags, scenario, profile);
  bridge_ = std::make_unique<RosBridge>(simulation, profile, epoch);
  for (const std::string& path : flags.records) {
    if (fs::path(path).extension() != ".mcap") {
      throw InputError(fmt::format("--record: {}: give a name that ends in .mcap", path));
    }
    if (std::find(paths_.begin(), paths_.end(), path) != paths_.end()) {
      throw InputError(fmt::format("--record: {} is given twice", path));
    }
    McapOptions options;
    options.compression = flags.compression;
    auto writer = std::make_unique<McapWriter>(path, options);
    if (!scenario.path.empty()) {
      const MappedFile file(scenario.path);
      const auto bytes = file.bytes();
      writer->attach("scenario.yaml",
                     "application/yaml",
                     {reinterpret_cast<const char*>(bytes.data()), bytes.size()},
                     epoch.count());
    } else {
      writer->attach("scenario.yaml", "application/yaml", scenario_yaml(scenario), epoch.count());
    }
    paths_.push_back(path);
    outlets_.push_back(std::move(writer));
    bridge_->add(*outlets_.back());
  }
}

RosSession::~RosSession() = default;

void RosSession::start() {
  if (bridge_) bridge_->start();
}

void RosSession::on_time(SimTime time) {
  if (bridge_) bridge_->on_time(time);
}

void RosSession::close() {
  for (std::size_t i = 0; i < outlets_.size(); ++i) {
    outlets_[i]->close();
    log(fmt::format(
        "recorded {}, {:.1f} MB", paths_[i], 1e-6 * static_cast<double>(fs::file_size(paths_[i]))));
  }
}

}  // namespace pointflight::apps
