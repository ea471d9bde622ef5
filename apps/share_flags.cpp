#include "apps/share_flags.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <array>
#include <chrono>
#include <random>

#include "apps/modules.hpp"
#include "apps/terminal.hpp"
#include "pointflight/core/input_error.hpp"
#include "ros_common/ros_names.hpp"
#include "share/vehicle_list.hpp"

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

void check_share_flags(const ShareFlags& flags) {
  if (!flags.is_asked()) {
    if (!flags.vehicles.empty()) throw InputError("--vehicles: has no effect without --share");
    if (flags.localhost) throw InputError("--share-localhost: has no effect without --share");
    return;
  }
  if (!is_ros_word(flags.name) || flags.name.size() > kNameMost) {
    throw InputError(fmt::format(
        "--share: '{}'; letters, digits and _ only, {} at most", flags.name, kNameMost));
  }
  if (flags.vehicles.empty()) {
    throw InputError("--share: say which vehicles this process flies with --vehicles 0-3");
  }
}

bool is_free(const ShareFlags& flags, const Scenario& scenario) {
  return flags.is_asked() && share_setup_of(scenario).time == ShareTime::kFree;
}

SharedRun::SharedRun(const ShareFlags& flags,
                     Simulation& simulation,
                     const RunLoop& loop,
                     double rate) {
  const ShareSetup& setup = share_setup_of(simulation.scenario());
  if (setup.time == ShareTime::kFree && rate <= 0.0) {
    throw InputError(
        "--rate max: processes that keep time by their clocks need a rate; give one, or "
        "share: {time: lockstep} in the scenario");
  }
  FleetShareOptions options;
  options.run = flags.name;
  options.process = process_name();
  options.id = random_id();
  options.vehicles = vehicles_of(flags, simulation);
  options.rate = rate;
  options.steady = steady_ns;
  options.clock = [&loop](std::int64_t steady) {
    return loop.due_at(std::chrono::steady_clock::time_point(Duration(steady)));
  };
  options.log = [](const std::string& line) { log(line); };
  options.interrupted = interrupted;
  ShareTransportOptions transport;
  transport.name = flags.name;
  transport.lockstep = setup.time == ShareTime::kLockstep;
  transport.lease = setup.lease;
  transport.localhost_only = flags.localhost;
  transport.ahead = setup.ahead;
  transport_ = dds_module().share(transport);
  share_ = std::make_unique<FleetShare>(simulation, *transport_, std::move(options));
  share_->take_part(simulation);
  link_ = std::make_unique<ShareLink>(simulation, *share_);
}

void SharedRun::say() const {
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
  if (share_->peers().empty()) log("nobody else took part");
  if (share_->foreign() > 0) {
    log(fmt::format("{} messages were of somebody else and left out", share_->foreign()));
  }
}

}  // namespace pointflight::apps
