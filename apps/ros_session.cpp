#include "apps/ros_session.hpp"

#include <fmt/format.h>

#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <algorithm>
#include <array>
#include <filesystem>
#include <thread>

#include "apps/flags.hpp"
#include "apps/modules.hpp"
#include "apps/terminal.hpp"
#include "pointflight/core/input_error.hpp"
#include "pointflight/core/locked_file.hpp"
#include "pointflight/core/mapped_file.hpp"
#include "recording/mcap_writer.hpp"
#include "ros_common/ros_names.hpp"

namespace pointflight::apps {
namespace {

namespace fs = std::filesystem;

/// Some ROS programs misread times near zero: runs start here unless told otherwise.
constexpr Duration kFixedEpoch = std::chrono::seconds(1'700'000'000);
constexpr double kEndless = 1e6;  // s

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
  // living nodes must not see time jump back after a restart; recordings by themselves and runs in
  // lockstep are the same each time
  const bool live = flags.is_live() && flags.lockstep <= 0.0;
  return live && profile.epoch == "now" ? epoch_from("now", "") : kFixedEpoch;
}

/// The file that a scenario came from, or the scenario as a file.
std::string text_of(const Scenario& scenario) {
  if (scenario.path.empty()) return scenario_yaml(scenario);
  const MappedFile file(scenario.path);
  const auto bytes = file.bytes();
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

}  // namespace

/// Counts scans, for lockstep.
class RosSession::ScanCount : public SampleSink {
 public:
  void on_sample(const Sample& sample) override {
    const auto* scanned = std::get_if<ScanSample>(&sample);
    if (scanned == nullptr) return;
    ++scans;
    if (const auto late = lateness ? lateness(scanned->scan->end) : std::nullopt) {
      const double bin = std::clamp(*late / kBin, 0.0, static_cast<double>(delays_.size() - 1));
      ++delays_[static_cast<std::size_t>(bin)];
      ++delayed;
    }
  }

  /// The delay that a share of all scans stayed below, s.
  [[nodiscard]] double delay_at(double share) const {
    std::uint64_t below = 0;
    std::size_t bin = 0;
    const auto wanted = static_cast<std::uint64_t>(share * static_cast<double>(delayed));
    while (bin + 1 < delays_.size() && below + delays_[bin] <= wanted) {
      below += delays_[bin++];
    }
    return kBin * (static_cast<double>(bin) + 0.5);
  }

  std::uint64_t scans = 0;
  std::uint64_t answered = 0;
  Lateness lateness;
  std::uint64_t delayed = 0;  ///< Scans whose delay was measured.

 private:
  static constexpr double kBin = 1e-4;          // s
  std::array<std::uint64_t, 100000> delays_{};  ///< From a scan's end until it was handed over.
};

void add_ros_flags(CLI::App& app, RosFlags& flags) {
  app.add_flag("--ros1", flags.ros1, "Publish to ROS 1 and take commands from it, in real time");
  app.add_flag("--ros2", flags.ros2, "The same with ROS 2, for which none has to be installed");
  app.add_flag("--ros2-localhost", flags.localhost, "Let only this machine find the ROS 2 node");
  app.add_option("--profile",
                 flags.profile,
                 "Names of messages: default, marsim, ego, livox, ... or a path (docs/ros.md)");
  app.add_option("--epoch", flags.epoch, "Stamps start 'now', or at seconds since 1970");
  app.add_option("--node", flags.node, "Name of the ROS node")->capture_default_str();
  app.add_flag("--no-wait", flags.no_wait, "Fly even while there is no ROS 1 master yet");
  auto* stay = app.add_flag("--stay",
                            flags.stay,
                            "Hover when the mission is flown, until interrupted (the default with "
                            "ROS in real time, unless --lockstep or a duration is given)");
  app.add_flag("--no-stay", flags.no_stay, "End when the mission is flown")->excludes(stay);
  app.add_option("--lockstep",
                 flags.lockstep,
                 "Wait after each scan for a command, so many seconds at most")
      ->check(within(0.0, 3600.0));
  app.add_option("--record",
                 flags.records,
                 "Record all messages into FILE.mcap (ROS 2) or FILE.bag (ROS 1); again for more")
      ->type_name("FILE")
      ->expected(1)
      ->take_all();
  app.add_option("--compression", flags.compression, "Of recordings: zstd, lz4 or none")
      ->check(CLI::IsMember({"zstd", "lz4", "none"}))
      ->capture_default_str();
}

void check_ros_flags(const RosFlags& flags) {
  for (const auto& [flag, given] : {std::pair{"--lockstep", flags.lockstep > 0.0},
                                    std::pair{"--stay", flags.stay},
                                    std::pair{"--no-wait", flags.no_wait}}) {
    if (given && !flags.is_live()) {
      throw InputError(fmt::format("{}: has no effect without --ros1 or --ros2", flag));
    }
  }
  if (!flags.profile.empty() && !flags.any()) {
    throw InputError("--profile: has no effect without --ros1, --ros2 or --record");
  }
}

void prepare_for_ros(const RosFlags& flags, double rate, Scenario& scenario) {
  if (!flags.any()) return;
  const RosProfile profile = profile_for(scenario, flags.profile);
  scenario.output.odometry_rate =
      std::max(scenario.output.odometry_rate, RosBridge::odometry_rate(profile));
  const bool planned = std::any_of(
      scenario.vehicles.begin(), scenario.vehicles.end(), [](const VehicleSetup& vehicle) {
        return !vehicle.mission.waypoints.empty() || !vehicle.commands.empty();
      });
  if (!flags.is_live()) return;
  const bool is_open = scenario.duration <= 0.0;
  const bool stays = rate > 0.0 && flags.lockstep <= 0.0 && !flags.no_stay;
  if (flags.stay || (is_open && (stays || !planned))) scenario.duration = kEndless;
}

RosSession::RosSession(const RosFlags& flags, Simulation& simulation)
    : flags_(flags), simulation_(simulation) {
  if (!flags.any()) return;
  const bool digit = flags.node.find_first_of("0123456789") == 0;
  if (!is_ros_word(flags.node) || digit) {
    throw InputError(
        fmt::format("--node: '{}'; letters, digits and _ only, and no digit at first", flags.node));
  }
  const Scenario& scenario = simulation.scenario();
  const RosProfile profile = profile_for(scenario, flags.profile);
  const Duration epoch = epoch_of(flags, scenario, profile);
  bridge_ = std::make_unique<RosBridge>(simulation, profile, epoch);
  for (const std::string& path : flags.records) open_recording(path, epoch);
  TransportOptions options;
  options.node = flags.node;
  options.log = [](const std::string& text) { log(text); };
  options.localhost_only = flags.localhost;
  if (flags.ros2) options.large_rate = large_rate(simulation, profile);
  if (flags.ros1) transports_.push_back(ros1_module().transport(options));
  if (flags.ros2) transports_.push_back(ros2_module().transport(options));
  inbox_ = std::make_unique<Inbox>(simulation, profile);
  for (const auto& transport : transports_) {
    bridge_->add(*transport);
    inbox_->connect(*transport);
  }
  if (flags.lockstep > 0.0) bridge_->keep_scans();
  scans_ = std::make_unique<ScanCount>();
  splitter_ = std::make_unique<SampleSplitter>();
  splitter_->add(*bridge_);
  splitter_->add(*scans_);
}

void RosSession::open_recording(const std::string& path, Duration epoch) {
  const bool is_mcap = fs::path(path).extension() == ".mcap";
  if (!is_mcap && fs::path(path).extension() != ".bag") {
    throw InputError(fmt::format("--record: {}: give a name that ends in .mcap or .bag", path));
  }
  for (const auto& other : recordings_) {
    if (fs::weakly_canonical(other->path()) == fs::weakly_canonical(path)) {
      throw InputError(fmt::format("--record: {} is given twice", path));
    }
  }
  check_recording({path, flags_.overwrite});
  if (is_mcap) {
    McapOptions options;
    options.compression = flags_.compression;
    auto writer = std::make_unique<McapWriter>(path, options);
    writer->attach(
        "scenario.yaml", "application/yaml", text_of(simulation_.scenario()), epoch.count());
    recordings_.push_back(std::make_unique<Recording>(path, std::move(writer)));
  } else {
    const Ros1Module& ros1 = ros1_module();
    // rosbag itself knows of no locks
    const int lock = open_locked(path + ".active", path + ".active");
    // bags know no zstd
    const std::string compression = flags_.compression == "zstd" ? "lz4" : flags_.compression;
    recordings_.push_back(
        std::make_unique<Recording>(path, ros1.bag_writer(path, compression), lock));
  }
  bridge_->add(*recordings_.back());
}

void RosSession::say_failed_recordings() {
  for (const auto& recording : recordings_) {
    if (const auto why = recording->take_failure()) {
      log(fmt::format("warning: the recording ends here: {}", *why));
    }
  }
}

std::size_t RosSession::failed_recordings() const {
  return static_cast<std::size_t>(std::count_if(
      recordings_.begin(), recordings_.end(), [](const auto& r) { return r->has_failed(); }));
}

RosSession::~RosSession() {
  close_transports();
}

void RosSession::close_transports() {
  for (const auto& transport : transports_) {
    transport->close();
    if (!transport->has_ended()) leave_static_objects();
  }
}

void RosSession::measure_lateness(Lateness lateness) {
  if (scans_ && flags_.is_live()) scans_->lateness = std::move(lateness);
}

SampleSink* RosSession::sink() {
  return splitter_.get();
}

bool RosSession::is_over() const {
  return interrupted() || std::any_of(transports_.begin(), transports_.end(), [](const auto& t) {
           return t->is_over();
         });
}

bool RosSession::start() {
  if (!bridge_) return true;
  bridge_->start();
  while (!flags_.no_wait && std::any_of(transports_.begin(), transports_.end(), [](const auto& t) {
    return !t->is_connected();
  })) {
    for (const auto& transport : transports_) {
      if (const std::string why = transport->failure(); !why.empty()) throw InputError(why);
    }
    if (is_over()) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return flags_.lockstep <= 0.0 || wait_for_planner();
}

/// So that the first scan reaches somebody who answers it. A reader that we know of may not know of
/// us yet, so a moment more is waited.
bool RosSession::wait_for_planner() {
  constexpr std::chrono::milliseconds kLook(20);
  constexpr std::chrono::milliseconds kSettled(500);
  const auto is_there = [&] {
    return bridge_->has_scan_readers() &&
           std::any_of(transports_.begin(), transports_.end(), [](const auto& transport) {
             return transport->has_senders();
           });
  };
  if (transports_.empty()) return true;
  bool said = false;
  std::chrono::milliseconds settled(0);
  while (settled < kSettled) {
    if (is_over()) return false;
    settled = is_there() ? settled + kLook : std::chrono::milliseconds(0);
    if (settled.count() == 0 && !std::exchange(said, true)) {
      log("lockstep: waiting for somebody who reads scans and sends commands");
    }
    bridge_->repeat();
    std::this_thread::sleep_for(kLook);
  }
  if (said) log("lockstep: a planner is there");
  return true;
}

RosSession::Next RosSession::after_step(double took) {
  if (!bridge_) return Next::kStep;
  if (!paused_ || step_once_) {
    const std::uint64_t taken = scans_->scans - scans_->answered;
    // recordings know no wall clock
    if (taken > 0 && flags_.is_live() && recordings_.empty()) {
      bridge_->note_scan_time(took / static_cast<double>(taken));
    }
    bridge_->on_time(simulation_.time());
    if (flags_.lockstep > 0.0 && scans_->scans > scans_->answered) wait_for_answer();
    if (step_once_ && scans_->scans > scans_->answered) step_once_ = false;
    scans_->answered = scans_->scans;
  }
  say_failed_recordings();
  take_orders();
  if (std::exchange(reset_, false)) return Next::kReset;
  if (!paused_ || step_once_) return Next::kStep;
  bridge_->repeat();
  std::this_thread::sleep_for(std::chrono::milliseconds(20));
  return Next::kWait;
}

void RosSession::take_orders() {
  for (const Order& order : inbox_->take()) {
    if (const auto* vehicle = std::get_if<VehicleOrder>(&order)) {
      simulation_.command(vehicle->vehicle, vehicle->command);
      answers_ += vehicle->is_answer ? 1 : 0;
    } else if (const auto* pause = std::get_if<PauseOrder>(&order)) {
      if (paused_ != pause->pause) log(pause->pause ? "paused" : "going on");
      paused_ = pause->pause;
    } else if (std::holds_alternative<StepOrder>(order)) {
      step_once_ = paused_;
    } else {
      reset_ = true;
    }
  }
  say_troubles();
}

void RosSession::wait_for_answer() {
  using Clock = std::chrono::steady_clock;
  const std::uint64_t before = answers_;
  const auto until = Clock::now() + std::chrono::duration<double>(flags_.lockstep);
  while (answers_ == before && !paused_ && !reset_ && !is_over()) {
    if (Clock::now() > until) {
      if (late_answers_++ == 0) {
        log(fmt::format(
            "warning: no command within {} s of the scan at {:.1f} s; flying on (said once)",
            flags_.lockstep,
            to_seconds(simulation_.time())));
      }
      return;
    }
    std::this_thread::sleep_for(std::chrono::microseconds(200));
    bridge_->resend_scans();
    take_orders();
  }
}

/// The first of each kind at once, their number in the end.
void RosSession::say_troubles() {
  for (const std::string& reason : inbox_->take_new_reasons()) {
    log(fmt::format("warning: {}; left out (said once, counted)", reason));
  }
  if (const Inbox::Refused refused = inbox_->refused(); refused.count != told_refused_) {
    told_refused_ = refused.count;
    bridge_->note_refused(refused.count, refused.last);
  }
  if (said_rejected_ > 0) return;
  for (std::size_t v = 0; v < simulation_.vehicle_count(); ++v) {
    const AutopilotState& autopilot = simulation_.status(v).autopilot;
    if (autopilot.rejected == 0) continue;
    said_rejected_ = autopilot.rejected;
    log(fmt::format("warning: {}: {}; not taken (said once, counted)",
                    simulation_.vehicle(v).setup().name,
                    autopilot.last_rejection));
    return;
  }
}

void RosSession::was_reset(SimTime reached) {
  // stamps never go back: others would drop everything
  bridge_->shift_epoch(reached.time_since_epoch() + std::chrono::seconds(1));
  log("reset: at the start again; stamps go on");
}

void RosSession::close() {
  for (const auto& recording : recordings_) {
    recording->close();
    if (recording->has_failed()) continue;
    log(fmt::format("recorded {}, {:.1f} MB",
                    recording->path(),
                    1e-6 * static_cast<double>(fs::file_size(recording->path()))));
  }
  say_failed_recordings();
  close_transports();
  for (const auto& transport : transports_) {
    if (const std::string why = transport->failure(); !why.empty()) log(why);
    if (transport->dropped() > 0) {
      log(fmt::format("{} messages were dropped for slow subscribers", transport->dropped()));
    }
  }
  if (scans_ && scans_->delayed > 0) {
    log(fmt::format("scans left {:.1f} ms after their end (median), {:.1f} ms at p99",
                    1e3 * scans_->delay_at(0.5),
                    1e3 * scans_->delay_at(0.99)));
  }
  if (const auto count = inbox_ ? inbox_->refused().count : 0; count > 0) {
    log(fmt::format("{} messages were left out; the last: {}", count, inbox_->refused().last));
  }
  if (late_answers_ > 0) {
    log(fmt::format("{} scans had no command within {} s", late_answers_, flags_.lockstep));
  }
}

}  // namespace pointflight::apps
