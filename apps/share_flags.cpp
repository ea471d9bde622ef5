#include "apps/share_flags.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <random>

#include "apps/cli.hpp"
#include "apps/modules.hpp"
#include "apps/terminal.hpp"
#include "pointflight/core/input_error.hpp"
#include "pointflight/ros/common/ros_names.hpp"
#include "pointflight/share/common_ground.hpp"
#include "pointflight/share/vehicle_list.hpp"
#include "pointflight/sim/interrupted_run.hpp"

namespace pointflight::apps {
namespace {

constexpr std::size_t kNameMost = 64;

std::int64_t steady_ns() {
  return std::chrono::duration_cast<Duration>(std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

/// "host:4711"
std::string process_name() {
  std::array<char, 65> host{};
  if (gethostname(host.data(), host.size() - 1) != 0) host = {'?'};
  return fmt::format("{}:{}", host.data(), getpid());
}

std::uint64_t random_id() {
  std::random_device device;
  const std::uint64_t high = device();
  return (high << 32 | device()) | 1;  // never 0
}

std::vector<std::size_t> vehicles_of(const ShareFlags& flags, const Simulation& simulation) {
  std::vector<std::string> names;
  for (std::size_t v = 0; v < simulation.vehicle_count(); ++v) {
    names.push_back(simulation.vehicle(v).setup().name);
  }
  try {
    return vehicles_from(flags.vehicles, names);
  } catch (const InputError& error) {
    throw InputError(fmt::format("--vehicles: {}", error.what()));
  }
}

}  // namespace

void add_share_flags(CLI::App& app, ShareFlags& flags) {
  app.add_option(
         "--share",
         flags.name,
         "Share the run NAME with other processes and machines, each of which flies some of "
         "the vehicles (docs/swarms.md)")
      ->type_name("NAME");
  app.add_option("--vehicles",
                 flags.vehicles,
                 "With --share: those that this process flies: 0-3, or 0,2 or names")
      ->delimiter(',')
      ->type_name("LIST");
  app.add_flag("--share-localhost", flags.localhost, "With --share: on this machine alone");
}

void SharePart::check() const {
  if (!flags_.is_asked()) {
    if (!flags_.vehicles.empty()) throw InputError("--vehicles: has no effect without --share");
    if (flags_.localhost) throw InputError("--share-localhost: has no effect without --share");
    return;
  }
  if (!is_ros_word(flags_.name) || flags_.name.size() > kNameMost) {
    throw InputError(fmt::format(
        "--share: '{}'; letters, digits and _ only, {} at most", flags_.name, kNameMost));
  }
  if (flags_.vehicles.empty()) {
    throw InputError("--share: say which vehicles this process flies with --vehicles 0-3");
  }
}

bool SharePart::is_live(const Scenario& scenario) const {
  return flags_.is_asked() && share_setup_of(scenario).time == ShareTime::kFree;
}

void SharePart::prepare(Scenario& scenario, double rate) {
  rate_ = rate;
  if (is_live(scenario) && rate <= 0.0) {
    throw InputError(
        "--rate max: processes that keep time by their clocks need a rate; give one, or "
        "share: {time: lockstep} in the scenario");
  }
}

void SharePart::connect(Simulation& simulation, RunLoop& loop) {
  if (!flags_.is_asked()) return;
  join(simulation, loop);
  resume(simulation);
  loop.add(*link_);
}

void SharePart::join(Simulation& simulation, const RunLoop& loop) {
  const ShareSetup& setup = share_setup_of(simulation.scenario());
  FleetShareOptions options;
  options.run = flags_.name;
  options.process = process_name();
  options.id = random_id();
  options.vehicles = vehicles_of(flags_, simulation);
  options.rate = rate_;
  options.steady = steady_ns;
  options.clock = [&loop](std::int64_t steady) {
    return loop.due_at(std::chrono::steady_clock::time_point(Duration(steady)));
  };
  options.log = [](const std::string& line) { log(line); };
  options.interrupted = interrupted;
  ShareTransportOptions transport;
  transport.name = flags_.name;
  transport.lockstep = setup.time == ShareTime::kLockstep;
  transport.lease = setup.lease;
  transport.localhost_only = flags_.localhost;
  transport.ahead = setup.ahead;
  transport.log = [](const std::string& line) { log(line); };
  transport_ = dds_module().share(transport);
  share_ = std::make_unique<FleetShare>(simulation, *transport_, std::move(options));
  share_->take_part(simulation);
  link_ = std::make_unique<ShareLink>(simulation, *share_);
}

/// A process that was killed goes on where its trajectory ends, if the scenario says so.
void SharePart::resume(Simulation& simulation) const {
  const bool wanted = share_setup_of(simulation.scenario()).on_return == OnReturn::kLog;
  if (!wanted || folder_.empty()) return;
  const auto ended = ended_run(folder_, simulation, simulation.flying_here());
  if (!ended) return;
  if (!was_run_of(ended->scenario, simulation)) {
    log(fmt::format(
        "{}: what an earlier run left there is of another scenario; begins at the start", folder_));
    return;
  }
  simulation.resume_at(ended->time, ended->skipped, ended->states);
  log(fmt::format("{}: goes on where an earlier run's trajectories end, at {:.2f} s",
                  folder_,
                  to_seconds(ended->time)));
}

bool SharePart::has_failed() const {
  return share_ != nullptr && !share_->fault().empty();
}

void SharePart::report(const RunLoop& loop) const {
  if (share_ == nullptr) return;
  for (const FleetShare::PeerReport& peer : share_->peers()) {
    std::string line = fmt::format("{} flew {} vehicle{}",
                                   peer.process,
                                   peer.vehicles.size(),
                                   peer.vehicles.size() == 1 ? "" : "s");
    if (peer.offset) {
      line += fmt::format("; its clock was {:+.1f} ms off (+- {:.1f})",
                          1e3 * *peer.offset,
                          1e3 * peer.offset_error);
    }
    line += fmt::format("; {} messages, {} lost", peer.received, peer.missing);
    log(line);
  }
  if (share_->peers().empty() && loop.has_started()) log("nobody else took part");
  if (share_->foreign() > 0) {
    log(fmt::format("{} messages were of somebody else and left out", share_->foreign()));
  }
  if (has_failed()) log(share_->fault());
}

}  // namespace pointflight::apps
