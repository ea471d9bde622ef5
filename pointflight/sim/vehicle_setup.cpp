// A vehicle as its scenario has it: model, sensors, faults, commands.
#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <stdexcept>
#include <utility>

#include "pointflight/core/constants.hpp"
#include "pointflight/core/input_error.hpp"
#include "pointflight/core/resources.hpp"
#include "pointflight/sim/vehicle_agent.hpp"
#include "pointflight/vehicle/feasibility.hpp"
#include "pointflight/vehicle/vehicle_shape.hpp"

namespace pointflight {
namespace {

constexpr double kSettleTime = 1.0;      // s after the last that is to be done
constexpr double kCommandTime = 5.0;     // s for a command without an end of its own
constexpr std::size_t kLidarsMax = 256;  // their numbers have 8 bits in random streams

/// What the recorder calls files of its own.
bool is_file_of_every_vehicle(const std::string& name) {
  return name == "trajectory" || name == "scans" || name == "imu" || name == "odometry";
}

/// The vehicle's file with what the scenario changes of it.
VehicleSettings settings_of(const Scenario& scenario,
                            std::size_t number,
                            const VehicleSetup& setup) {
  VehicleSettings s = scenario.at(scenario.vehicle_key(number, "model"),
                                  [&] { return load_vehicle(setup.model, scenario.folder()); });
  ControllerSettings& c = s.controller;
  if (setup.controller) c.kind = *setup.controller;
  const auto override_with = [](double value, double& setting) {
    if (value > 0.0) setting = value;
  };
  override_with(setup.limits.speed_max, c.speed_max);
  override_with(setup.limits.acceleration_max, c.acceleration_max);
  override_with(setup.limits.climb_acceleration_max, c.climb_acceleration_max);
  override_with(setup.limits.tilt_max_deg, c.tilt_max_deg);
  override_with(setup.limits.body_rate_max, c.body_rate_max);
  override_with(setup.imu_rate, s.imu.rate);
  if (c.tilt_max_deg > c.kind->tilt_max_deg) {
    throw InputError(
        fmt::format("{}: a tilt of {} degrees; `controller: {}` flies up to {}, geometric beyond",
                    scenario.location(scenario.vehicle_key(number, "limits.tilt_max_deg")),
                    c.tilt_max_deg,
                    c.kind->name,
                    c.kind->tilt_max_deg));
  }
  if (setup.battery && s.battery.cells <= 0.0) {
    throw InputError(fmt::format("{}: {} has no battery; write one into its file",
                                 scenario.location(scenario.vehicle_key(number, "battery")),
                                 s.path));
  }
  return s;
}

/// Physics steps in a control period.
std::uint64_t control_steps(const Scenario& scenario,
                            std::size_t number,
                            const VehicleSetup& setup) {
  if (setup.control_period == 0.0) return 1;
  const double count = std::round(setup.control_period / scenario.physics_step);
  if (count < 1.0 || std::abs(count * scenario.physics_step - setup.control_period) > 1e-9) {
    throw InputError(fmt::format("{}: {} s are no whole number of physics steps of {} s",
                                 scenario.location(scenario.vehicle_key(number, "control_period")),
                                 setup.control_period,
                                 scenario.physics_step));
  }
  return static_cast<std::uint64_t>(count);
}

}  // namespace

VehicleAgent::VehicleAgent(const Scenario& scenario,
                           std::size_t number,
                           const VehicleSetup& setup,
                           SharedParts& shared)
    : number_(static_cast<std::uint32_t>(number)),
      setup_(setup),
      seed_(static_cast<std::uint64_t>(setup.seed >= 0 ? setup.seed : scenario.seed)),
      dynamics_(settings_of(scenario, number, setup)),
      autopilot_(dynamics_.settings(), from_seconds(setup.command_timeout)),
      control_steps_(control_steps(scenario, number, setup)),
      battery_(dynamics_.settings()),
      wind_(scenario.air.wind, seed_),
      faults_(setup.faults),
      hull_(dynamics_.settings().hull()),
      shape_(hull_),
      look_(settings().airframe.seen_as_hull
                ? nullptr
                : std::make_shared<const Assembly>(assembly_of(settings()))),
      mission_(
          std::make_shared<Mission>(setup.start, setup.start_yaw_deg * kDegree, setup.mission)),
      state_schedule_(scenario.output.trajectory_rate) {
  mount_sensors(scenario, shared);
  view_ = shared.renderer("beam");
  if (scenario.air.ground_effect && settings().rotor.radius > 0.0) ground_sensor_ = view_;
  check_faults(scenario);
  read_commands(scenario);
}

void VehicleAgent::mount_sensors(const Scenario& scenario, SharedParts& shared) {
  if (setup_.sensors.size() > kLidarsMax - 2) {
    throw InputError(fmt::format("{}: {} sensors on one vehicle; {} at most",
                                 scenario.location(scenario.vehicle_key(number_, "sensors")),
                                 setup_.sensors.size(),
                                 kLidarsMax - 2));
  }
  if (setup_.lidars.size() > kLidarsMax) {
    throw InputError(fmt::format("{}: {} lidars on one vehicle; {} at most",
                                 scenario.location(scenario.vehicle_key(number_, "lidars")),
                                 setup_.lidars.size(),
                                 kLidarsMax));
  }
  const auto site = [&](std::size_t sensor) {
    return SensorSite{number_, static_cast<std::uint32_t>(sensor), seed_, scenario.origin};
  };
  mount(nullptr,
        std::make_unique<OdometrySource>(
            scenario.output.odometry_rate, setup_.odometry, site(0), faults_));
  mount(nullptr, std::make_unique<OnboardImu>(settings(), site(sensors_.size()), faults_));
  for (std::size_t i = 0; i < setup_.sensors.size(); ++i) {
    const SensorSetup& sensor = setup_.sensors[i];
    const std::string key = scenario.vehicle_key(number_, fmt::format("sensors[{}]", i));
    mount(sensor.kind, scenario.at(key, [&] {
      if (sensor.kind == nullptr) throw InputError("a sensor needs a kind");
      if (is_file_of_every_vehicle(sensor.kind->name)) {
        throw InputError(fmt::format(
            "'{}' is a file of every vehicle; call the kind something else", sensor.kind->name));
      }
      const bool open = !sensor.settings.has_value();
      return sensor.kind->make(site(sensors_.size()),
                               open ? sensor.kind->settings : sensor.settings);
    }));
  }
  for (std::size_t i = 0; i < setup_.lidars.size(); ++i) {
    const LidarMount& entry = setup_.lidars[i];
    const std::string key = scenario.vehicle_key(number_, fmt::format("lidars[{}].model", i));
    auto lidar = scenario.at(key, [&] {
      const SharedParts::LidarModel& model = shared.lidar(entry.model);
      const Surroundings surroundings = surroundings_in(shared.map(), scenario.surroundings);
      LidarSettings settings = model.settings;
      if (entry.sub_rays >= 0) settings.optics.sub_rays = entry.sub_rays;
      if (!entry.blocked.empty()) {
        settings.blocked =
            std::filesystem::absolute(resolve_path(entry.blocked, scenario.folder())).string();
      }
      Lidar made(settings, MountedLidar::entity_of(site(i)), model.beams, surroundings);
      return std::make_unique<MountedLidar>(
          entry, std::move(made), site(i), shared.renderer(entry.renderer), shared.map(), faults_);
    });
    lidars_.push_back(lidar.get());
    mount(nullptr, std::move(lidar));
  }
}

void VehicleAgent::mount(const SensorKind* kind, std::unique_ptr<const Sensor> sensor) {
  const auto* instant = dynamic_cast<const InstantSensor*>(sensor.get());
  const auto* interval = dynamic_cast<const IntervalSensor*>(sensor.get());
  if ((instant == nullptr) == (interval == nullptr)) {
    throw std::invalid_argument("a sensor is an InstantSensor or an IntervalSensor");
  }
  sensors_.push_back({kind, std::move(sensor), instant, interval});
}

void VehicleAgent::check_faults(const Scenario& scenario) const {
  const auto check_index = [&](std::size_t fault, const char* what, std::size_t count) {
    if (static_cast<std::size_t>(setup_.faults[fault].index) < count) return;
    throw InputError(fmt::format(
        "{}: {} {} of a vehicle with {}",
        scenario.location(scenario.vehicle_key(number_, fmt::format("faults[{}].index", fault))),
        what,
        setup_.faults[fault].index,
        count));
  };
  for (std::size_t i = 0; i < setup_.faults.size(); ++i) {
    const std::string name = scenario.vehicle_key(number_, fmt::format("faults[{}].", i));
    check(setup_.faults[i], [&](const char* key, const std::string& what) {
      throw InputError(fmt::format("{}: {}{}: {}", scenario.location(name + key), name, key, what));
    });
    const FaultKind kind = setup_.faults[i].kind;
    if (kind == FaultKind::kRotor) check_index(i, "rotor", settings().rotors.size());
    if (kind == FaultKind::kLidar || kind == FaultKind::kScanDrop)
      check_index(i, "lidar", lidars_.size());
  }
}

void VehicleAgent::read_commands(const Scenario& scenario) {
  if (!setup_.mission.waypoints.empty()) {
    commands_.push_back({SimTime{}, TrajectoryCommand{mission_}});
    busy_time_ = mission_->duration() + kSettleTime;
  }
  for (std::size_t i = 0; i < setup_.commands.size(); ++i) {
    const CommandSettings& s = setup_.commands[i];
    const auto key = [&](const char* name) {
      return scenario.vehicle_key(number_, fmt::format("commands[{}].{}", i, name));
    };
    if (s.kind->name == BodyRateCommand::kName && !s.vector.isZero(0.0)) {
      throw InputError(fmt::format("{}: {}: body rates are given as rates_deg: [x, y, z], in deg/s",
                                   scenario.location(key("vector")),
                                   key("vector")));
    }
    const Command command = scenario.at(key(s.file.empty() ? "kind" : "file"), [&] {
      Command made = s.kind->make(s, {settings(), setup_.mission.motion, scenario.folder()});
      if (const auto reason = autopilot_.objection(made)) throw InputError(*reason);
      return made;
    });
    const SimTime time{from_seconds(s.time)};
    if (!commands_.empty() && time < commands_.back().time) {
      throw InputError(fmt::format("{}: {} s comes before the command above it; sort them by time",
                                   scenario.location(key("time")),
                                   s.time));
    }
    commands_.push_back({time, command});
    double lasts = kCommandTime;
    if (const auto* t = std::get_if<TrajectoryCommand>(&command)) {
      lasts = t->trajectory->duration() + kSettleTime;
    }
    busy_time_ = std::max(busy_time_, s.time + lasts);
  }
}

std::vector<std::string> VehicleAgent::foreseen() const {
  std::vector<std::string> lines;
  for (const TimedCommand& timed : commands_) {
    const auto* command = std::get_if<TrajectoryCommand>(&timed.command);
    if (command == nullptr) continue;
    const auto words = beyond_limits(*command->trajectory, settings(), nullptr);
    if (!words) continue;
    lines.push_back(fmt::format(
        "{} at {:g} s: {}", setup_.name, to_seconds(timed.time.time_since_epoch()), *words));
  }
  return lines;
}

}  // namespace pointflight
