#include "apps/sitl_flags.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "apps/terminal.hpp"
#include "pointflight/core/input_error.hpp"
#include "pointflight/render/renderer.hpp"
#include "pointflight/sim/navigation_sensors.hpp"
#include "pointflight/sim/start_check.hpp"

namespace pointflight::apps {
namespace {

constexpr double kImuRate = 250.0;  // Hz, as PX4's start-up expects of simulators
constexpr double kOutputRate = 200.0;

/// What firmware needs to fly by, unless the vehicle has one: as a sensor that was calibrated.
template <class Settings>
void add_missing(VehicleSetup& vehicle, const char* kind, const Settings& settings) {
  const bool has_it = std::any_of(vehicle.sensors.begin(),
                                  vehicle.sensors.end(),
                                  [&](const SensorSetup& s) { return s.kind->name == kind; });
  if (!has_it) vehicle.sensors.push_back({sensor_kinds().find(kind), settings});
}

/// What PX4 asks of its simulators.
void equip_for_px4(VehicleSetup& vehicle) {
  if (vehicle.imu_rate <= 0.0) vehicle.imu_rate = kImuRate;
  // a compass that nobody has calibrated would turn the map
  MagnetometerSettings magnetometer;
  magnetometer.hard_iron = 0.2;
  magnetometer.scale_error = 0.002;
  add_missing(vehicle, "magnetometer", magnetometer);
  add_missing(vehicle, "barometer", BarometerSettings{});
  add_missing(vehicle, "gnss", GnssSettings{});
}

std::string without_slash(std::string path) {
  while (path.size() > 1 && path.back() == '/') path.pop_back();
  return path;
}

/// Number of the firmware's instance, which its ports go by.
std::uint16_t instance_of(const VehicleSetup& vehicle, std::size_t number) {
  const std::int64_t instance = vehicle.autopilot.instance;
  return static_cast<std::uint16_t>(instance >= 0 ? static_cast<std::size_t>(instance) : number);
}

}  // namespace

void add_sitl_flags(CLI::App& app, SitlFlags& flags) {
  app.add_flag("--px4",
               flags.px4,
               "PX4 flies the vehicles: start it with `px4 -i N`, vehicle N waits for it at TCP "
               "port 4560 + N (docs/autopilots.md)");
  app.add_flag(
      "--ardupilot",
      flags.ardupilot,
      "ArduPilot flies the vehicles: start it with `--model JSON:127.0.0.1 -I N`, vehicle N "
      "waits for it at UDP port 9002 + 10 N");
  app.add_option("--px4-start",
                 flags.start,
                 "PX4's program (bin/px4 of a build for SITL, or that build's folder): started for "
                 "each vehicle that PX4 flies, and ended with the flight; works in OUTPUT_px4/N")
      ->type_name("PX4");
  app.add_option("--sitl-address",
                 flags.address,
                 "IPv4 address that flight controllers are listened for at; 0.0.0.0: all of this "
                 "machine's")
      ->capture_default_str();
}

void SitlPart::check() const {
  if (flags_.px4 && flags_.ardupilot) {
    throw InputError(
        "--px4, --ardupilot: one of them for all vehicles, or `autopilot:` of each in a scenario");
  }
}

AutopilotKind SitlPart::kind_of(const VehicleSetup& vehicle) const {
  return flags_.px4         ? AutopilotKind::kPx4
         : flags_.ardupilot ? AutopilotKind::kArduPilot
                            : vehicle.autopilot.kind;
}

bool SitlPart::is_live(const Scenario& scenario) const {
  return std::any_of(scenario.vehicles.begin(),
                     scenario.vehicles.end(),
                     [&](const VehicleSetup& vehicle) { return is_flown(vehicle); });
}

void SitlPart::prepare(Scenario& scenario, double /*rate*/) {
  const bool has_px4 = std::any_of(
      scenario.vehicles.begin(), scenario.vehicles.end(), [&](const VehicleSetup& vehicle) {
        return kind_of(vehicle) == AutopilotKind::kPx4;
      });
  if (!flags_.start.empty() && !has_px4) {
    throw InputError("--px4-start: PX4 flies none of the vehicles; give --px4 or `autopilot: px4`");
  }
  if (!is_live(scenario)) return;
  const bool is_single = scenario.is_short;
  scenario.vehicles = scenario.fleet();  // each with an instance of its own
  scenario.is_short = is_single && scenario.vehicles.size() == 1;
  for (VehicleSetup& vehicle : scenario.vehicles) {
    vehicle.autopilot.kind = kind_of(vehicle);
    if (!is_flown(vehicle)) continue;
    if (!vehicle.mission.waypoints.empty() || !vehicle.commands.empty()) {
      log(fmt::format("note: {} is flown by a firmware: its mission and commands are left out",
                      vehicle.name));
      vehicle.mission.waypoints.clear();
      vehicle.commands.clear();
    }
    if (vehicle.autopilot.obstacles && vehicle.lidars.empty()) {
      throw InputError(
          fmt::format("{}: autopilot.obstacles: is for a vehicle with a LiDAR", vehicle.name));
    }
    vehicle.landed = true;
    vehicle.command_timeout = 0.0;  // the link says when nothing comes any more
    if (vehicle.autopilot.kind == AutopilotKind::kPx4) {
      equip_for_px4(vehicle);
    } else {
      vehicle.imu_rate = 1.0 / scenario.physics_step;  // a frame may be a step
    }
    lockstep_ = std::max(lockstep_, vehicle.autopilot.wait + 2.0);
  }
  scenario.output.trajectory_rate = std::max(scenario.output.trajectory_rate, kOutputRate);
  if (scenario.duration <= 0.0) scenario.duration = kLongestRun;
}

void SitlPart::place(Scenario& scenario, const std::shared_ptr<const SurfelMap>& map) const {
  if (!is_live(scenario)) return;
  const auto renderer = make_renderer("beam", Scene{map});
  for (VehicleSetup& vehicle : scenario.vehicles) {
    if (!is_flown(vehicle)) continue;
    const VehicleSettings settings = load_vehicle(vehicle.model, scenario.folder());
    vehicle.start = standing_below(*renderer, settings.hull(), vehicle.start);
  }
}

void SitlPart::connect(Simulation& simulation, RunLoop& loop) {
  for (std::size_t i = 0; i < simulation.vehicle_count(); ++i) {
    if (!simulation.flies_here(i)) continue;
    const AutopilotKind kind = simulation.vehicle(i).setup().autopilot.kind;
    if (kind == AutopilotKind::kPx4) add_px4(i, simulation, loop);
    if (kind == AutopilotKind::kArduPilot) add_ardupilot(i, simulation, loop);
  }
}

void SitlPart::add_px4(std::size_t number, Simulation& simulation, RunLoop& loop) {
  const VehicleSetup& vehicle = simulation.vehicle(number).setup();
  const std::uint16_t instance = instance_of(vehicle, number);
  Px4Options options;
  options.vehicle = number;
  options.address = flags_.address;
  options.port = static_cast<std::uint16_t>(Px4Options::kSimulatorPort + instance);
  options.offboard_port = static_cast<std::uint16_t>(Px4Options::kOffboardPort + instance);
  options.has_vision = vehicle.autopilot.vision;
  options.has_obstacles = vehicle.autopilot.obstacles;
  options.wait = vehicle.autopilot.wait;
  options.origin = simulation.scenario().origin;
  options.log = [](const std::string& line) { log(line); };
  const std::size_t child = started_.size();
  if (!flags_.start.empty()) options.is_gone = [this, child] { return started_[child]->is_gone(); };
  px4_names_.push_back(vehicle.name);
  px4_.push_back(std::make_unique<Px4Link>(std::move(options)));
  loop.add(*px4_.back());
  if (flags_.start.empty()) return;
  const std::string folder =
      fmt::format("{}/{}", output_.empty() ? "px4" : without_slash(output_) + "_px4", instance);
  started_.push_back(std::make_unique<StartedPx4>(flags_.start,
                                                  folder,
                                                  instance,
                                                  simulation.vehicle(number).settings(),
                                                  vehicle.autopilot.vision));
}

void SitlPart::add_ardupilot(std::size_t number, Simulation& simulation, RunLoop& loop) {
  const VehicleSetup& vehicle = simulation.vehicle(number).setup();
  ArduPilotOptions options;
  options.vehicle = number;
  options.address = flags_.address;
  options.port = static_cast<std::uint16_t>(
      ArduPilotOptions::kPort + ArduPilotOptions::kPortsApart * instance_of(vehicle, number));
  options.wait = vehicle.autopilot.wait;
  options.physics_step = simulation.scenario().physics_step;
  options.truth = [&simulation, number] { return simulation.status(number).state.body; };
  options.log = [](const std::string& line) { log(line); };
  ardupilot_names_.push_back(vehicle.name);
  ardupilot_.push_back(std::make_unique<ArduPilotLink>(std::move(options)));
  loop.add(*ardupilot_.back());
}

bool SitlPart::has_failed() const {
  return std::any_of(
      px4_.begin(), px4_.end(), [](const auto& link) { return link->report().is_cut; });
}

void SitlPart::report(const RunLoop& /*loop*/) const {
  for (std::size_t i = 0; i < px4_.size(); ++i) {
    const Px4Report& r = px4_[i]->report();
    log(fmt::format(
        "px4: {}: {} HIL_SENSOR sent, {} answers, {} waited for in vain, {} connection{}{}",
        px4_names_[i],
        r.sensors,
        r.answers,
        r.unanswered,
        r.connections,
        r.connections == 1 ? "" : "s",
        r.junk > 0 ? fmt::format(", {} bytes of junk", r.junk) : std::string()));
  }
  for (std::size_t i = 0; i < ardupilot_.size(); ++i) {
    const ArduPilotReport& r = ardupilot_[i]->report();
    log(fmt::format("ardupilot: {}: {} packets, {} repeated, {} waited for in vain{}",
                    ardupilot_names_[i],
                    r.packets,
                    r.repeated,
                    r.unanswered,
                    r.junk > 0 ? fmt::format(", {} datagrams of junk", r.junk) : std::string()));
  }
}

}  // namespace pointflight::apps
