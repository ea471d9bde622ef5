#include "apps/sitl_flags.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "apps/terminal.hpp"
#include "pointflight/core/input_error.hpp"
#include "pointflight/render/renderer.hpp"
#include "pointflight/sim/navigation_sensors.hpp"
#include "pointflight/sim/start_check.hpp"

namespace pointflight::apps {
namespace {

constexpr double kImuRate = 250.0;  // Hz, as PX4's start-up expects of simulators
constexpr double kOutputRate = 200.0;
constexpr double kEndless = kLongestRun;

/// What firmware needs to fly by, unless the vehicle has one: as a sensor that was calibrated.
template <class Settings>
void add_missing(VehicleSetup& vehicle, const char* kind, const Settings& settings) {
  const bool has_it = std::any_of(vehicle.sensors.begin(),
                                  vehicle.sensors.end(),
                                  [&](const SensorSetup& s) { return s.kind->name == kind; });
  if (!has_it) vehicle.sensors.push_back({sensor_kinds().find(kind), settings});
}

void equip(VehicleSetup& vehicle) {
  vehicle.landed = true;
  vehicle.command_timeout = 0.0;  // the link says when nothing comes any more
  if (vehicle.imu_rate <= 0.0) vehicle.imu_rate = kImuRate;
  // a compass that nobody has calibrated would turn the map
  MagnetometerSettings magnetometer;
  magnetometer.hard_iron = 0.2;
  magnetometer.scale_error = 0.002;
  add_missing(vehicle, "magnetometer", magnetometer);
  add_missing(vehicle, "barometer", BarometerSettings{});
  add_missing(vehicle, "gnss", GnssSettings{});
}

}  // namespace

void add_sitl_flags(CLI::App& app, SitlFlags& flags) {
  app.add_flag("--px4",
               flags.px4,
               "PX4 flies the vehicles: start it with `px4 -i N`, vehicle N waits for it at TCP "
               "port 4560 + N (docs/autopilots.md)");
  app.add_option("--sitl-address",
                 flags.address,
                 "IPv4 address that flight controllers are listened for at; 0.0.0.0: all of this "
                 "machine's")
      ->capture_default_str();
}

bool SitlPart::is_flown(const VehicleSetup& vehicle) const {
  return flags_.px4 || vehicle.autopilot.kind != AutopilotKind::kOwn;
}

bool SitlPart::is_live(const Scenario& scenario) const {
  return std::any_of(scenario.vehicles.begin(),
                     scenario.vehicles.end(),
                     [&](const VehicleSetup& vehicle) { return is_flown(vehicle); });
}

void SitlPart::prepare(Scenario& scenario, double /*rate*/) {
  if (!is_live(scenario)) return;
  const bool is_single = scenario.is_short;
  scenario.vehicles = scenario.fleet();  // each with an instance of its own
  scenario.is_short = is_single && scenario.vehicles.size() == 1;
  for (VehicleSetup& vehicle : scenario.vehicles) {
    if (!is_flown(vehicle)) continue;
    if (flags_.px4) vehicle.autopilot.kind = AutopilotKind::kPx4;
    if (vehicle.autopilot.kind == AutopilotKind::kArduPilot) {
      throw InputError(
          fmt::format("{}: autopilot: ardupilot is not built yet; px4 is", vehicle.name));
    }
    if (!vehicle.mission.waypoints.empty() || !vehicle.commands.empty()) {
      log(fmt::format("note: {} is flown by PX4: its mission and commands are left out",
                      vehicle.name));
      vehicle.mission.waypoints.clear();
      vehicle.commands.clear();
    }
    equip(vehicle);
    lockstep_ = std::max(lockstep_, vehicle.autopilot.wait + 2.0);
  }
  scenario.output.trajectory_rate = std::max(scenario.output.trajectory_rate, kOutputRate);
  if (scenario.duration <= 0.0) scenario.duration = kEndless;
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
    const VehicleSetup& vehicle = simulation.vehicle(i).setup();
    if (vehicle.autopilot.kind != AutopilotKind::kPx4 || !simulation.flies_here(i)) continue;
    const std::int64_t instance = vehicle.autopilot.instance;
    const auto number =
        static_cast<std::uint16_t>(instance >= 0 ? instance : static_cast<std::int64_t>(i));
    Px4Options options;
    options.vehicle = i;
    options.address = flags_.address;
    options.port = static_cast<std::uint16_t>(Px4Options::kSimulatorPort + number);
    options.offboard_port = static_cast<std::uint16_t>(Px4Options::kOffboardPort + number);
    options.has_vision = vehicle.autopilot.vision;
    options.has_obstacles = vehicle.autopilot.obstacles;
    options.wait = vehicle.autopilot.wait;
    options.origin = simulation.scenario().origin;
    options.log = [](const std::string& line) { log(line); };
    names_.push_back(vehicle.name);
    px4_.push_back(std::make_unique<Px4Link>(std::move(options)));
    loop.add(*px4_.back());
  }
}

void SitlPart::report(const RunLoop& /*loop*/) const {
  for (std::size_t i = 0; i < px4_.size(); ++i) {
    const Px4Report& r = px4_[i]->report();
    log(fmt::format(
        "px4: {}: {} HIL_SENSOR sent, {} answers, {} waited for in vain, {} connection{}{}",
        names_[i],
        r.sensors,
        r.answers,
        r.unanswered,
        r.connections,
        r.connections == 1 ? "" : "s",
        r.junk > 0 ? fmt::format(", {} bytes of junk", r.junk) : std::string()));
  }
}

}  // namespace pointflight::apps
