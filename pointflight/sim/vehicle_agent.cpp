#include "pointflight/sim/vehicle_agent.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "pointflight/core/constants.hpp"
#include "pointflight/core/input_error.hpp"
#include "pointflight/geometry/rotation.hpp"
#include "pointflight/vehicle/feasibility.hpp"

namespace pointflight {
namespace {

constexpr double kSettleTime = 1.0;          // s after the last that is to be done
constexpr double kCommandTime = 5.0;         // s for a command without an end of its own
constexpr double kTouchdown = 0.01;          // m above what carries a vehicle that lands
constexpr double kTouchdownSpeed = 3.0;      // m/s
constexpr double kGroundEffectReach = 10.0;  // propeller radii
constexpr std::size_t kLidarsMax = 256;      // their numbers have 8 bits in random streams

// order of a vehicle's samples at one instant, collisions first
constexpr std::size_t kEventRank = 1;
constexpr std::size_t kStateRank = 2;
constexpr std::size_t kSensorRank = 3;  // of the first; the others follow

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
  if (c.tilt_max_deg > c.kind->tilt_max_deg) {
    throw InputError(
        fmt::format("{}: a tilt of {} degrees; above 85 only `controller: geometric` flies",
                    scenario.place(scenario.vehicle_key(number, "limits.tilt_max_deg")),
                    c.tilt_max_deg));
  }
  if (setup.battery && s.battery.cells <= 0.0) {
    throw InputError(fmt::format("{}: {} has no battery; write one into its file",
                                 scenario.place(scenario.vehicle_key(number, "battery")),
                                 s.path));
  }
  return s;
}

}  // namespace

VehicleAgent::VehicleAgent(const Scenario& scenario,
                           std::size_t number,
                           const VehicleSetup& setup,
                           const RendererByKind& renderer)
    : number_(static_cast<std::uint32_t>(number)),
      setup_(setup),
      seed_(static_cast<std::uint64_t>(setup.seed >= 0 ? setup.seed : scenario.seed)),
      dynamics_(settings_of(scenario, number, setup)),
      autopilot_(dynamics_.settings(), from_seconds(setup.command_timeout)),
      battery_(dynamics_.settings()),
      wind_(scenario.air.wind, seed_),
      faults_(setup.faults),
      hull_(dynamics_.settings().hull()),
      shape_(hull_),
      mission_(
          std::make_shared<Mission>(setup.start, setup.start_yaw_deg * kDegree, setup.mission)),
      state_schedule_(scenario.output.trajectory_rate) {
  mount_sensors(scenario, renderer);
  if (scenario.air.ground_effect && settings().rotor.radius > 0.0) {
    ground_sensor_ = renderer("beam");
  }
  check_faults(scenario);
  read_commands(scenario);
}

void VehicleAgent::mount_sensors(const Scenario& scenario, const RendererByKind& renderer) {
  if (setup_.lidars.size() > kLidarsMax) {
    throw InputError(fmt::format("{}: {} lidars on one vehicle; {} at most",
                                 scenario.place(scenario.vehicle_key(number_, "lidars")),
                                 setup_.lidars.size(),
                                 kLidarsMax));
  }
  const auto site = [&](std::size_t sensor) {
    return SensorSite{number_, static_cast<std::uint32_t>(sensor), seed_};
  };
  mount(nullptr, std::make_unique<OdometrySource>(scenario.output.odometry_rate, faults_));
  mount(nullptr, std::make_unique<OnboardImu>(settings().imu, site(sensors_.size()), faults_));
  for (std::size_t i = 0; i < setup_.sensors.size(); ++i) {
    const SensorSetup& sensor = setup_.sensors[i];
    const std::string key = scenario.vehicle_key(number_, fmt::format("sensors[{}]", i));
    mount(sensor.kind, scenario.at(key, [&] {
      return sensor.kind->make(site(sensors_.size()), sensor.settings);
    }));
  }
  for (std::size_t i = 0; i < setup_.lidars.size(); ++i) {
    const LidarMount& entry = setup_.lidars[i];
    const std::string key = scenario.vehicle_key(number_, fmt::format("lidars[{}].model", i));
    auto lidar = scenario.at(key, [&] {
      return std::make_unique<MountedLidar>(entry,
                                            load_lidar(entry.model, scenario.folder()),
                                            site(i),
                                            renderer(entry.renderer),
                                            faults_);
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
        scenario.place(scenario.vehicle_key(number_, fmt::format("faults[{}].index", fault))),
        what,
        setup_.faults[fault].index,
        count));
  };
  for (std::size_t i = 0; i < setup_.faults.size(); ++i) {
    const std::string name = scenario.vehicle_key(number_, fmt::format("faults[{}].", i));
    check(setup_.faults[i], [&](const char* key, const std::string& what) {
      throw InputError(fmt::format("{}: {}{}: {}", scenario.place(name + key), name, key, what));
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
    if (s.kind == CommandKind::kBodyRates && !s.vector.isZero(0.0)) {
      throw InputError(fmt::format("{}: {}: body rates are given as rates_deg: [x, y, z], in deg/s",
                                   scenario.place(key("vector")),
                                   key("vector")));
    }
    const Command command = scenario.at(key(s.file.empty() ? "kind" : "file"), [&] {
      Command made = command_of(s, settings(), setup_.mission.motion, scenario.folder());
      if (const auto reason = autopilot_.objection(made)) throw InputError(*reason);
      return made;
    });
    const SimTime time{from_seconds(s.time)};
    if (!commands_.empty() && time < commands_.back().time) {
      throw InputError(fmt::format("{}: {} s comes before the command above it; sort them by time",
                                   scenario.place(key("time")),
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

VehicleStatus VehicleAgent::start() const {
  VehicleStatus status;
  status.state = dynamics_.hover_at(setup_.start, setup_.start_yaw_deg * kDegree);
  status.landed = setup_.landed;
  if (setup_.landed) {
    for (RotorState& rotor : status.state.rotors) rotor = {};
  }
  status.autopilot = autopilot_.start(status.state.body, setup_.landed);
  status.rotor_commands.assign(status.state.rotors.size(),
                               setup_.landed ? 0.0 : settings().hover_speed());
  for (const MountedSensor& sensor : sensors_) {
    const InstantSensor* instant = sensor.instant;
    status.sensors.push_back({0, instant != nullptr ? instant->memory_at_start() : std::any{}});
  }
  return status;
}

double VehicleAgent::ground_below(const VehicleStatus& status) const {
  const double reach = kGroundEffectReach * settings().rotor.radius;
  const auto& nearest = status.proximity.nearest;
  if (!ground_sensor_ || !nearest || nearest->distance > reach) {
    return -std::numeric_limits<double>::infinity();
  }
  Ray down;
  down.origin_world = status.state.body.p_world;
  down.direction_world = -Vector3f::UnitZ();
  down.range_max = static_cast<float>(reach + bounding_radius(hull_));
  const Hit hit = ground_sensor_->trace(down);
  return hit.is_return() ? down.origin_world.z() - static_cast<double>(hit.range)
                         : -std::numeric_limits<double>::infinity();
}

void VehicleAgent::control(VehicleStatus& status,
                           const SurfelMap& map,
                           SimTime now,
                           Duration step,
                           std::uint64_t step_number) const {
  const RigidBodyState& body = status.state.body;
  const double dt = to_seconds(step);
  if (!status.landed && touches_down(status)) status.landed = true;
  while (status.next_command < commands_.size() && commands_[status.next_command].time <= now) {
    command(status, commands_[status.next_command++].command, now);
    status.scripted = true;
  }
  // whatever it is told
  if (status.crashed || status.summary.battery_empty) status.autopilot.armed = false;
  // a level that must be repeated is, by the scenario
  if (status.scripted && status.autopilot.command.index() < std::variant_size_v<Setpoint>) {
    status.autopilot.since = now;
  }
  status.rotor_commands = autopilot_.rotor_speeds(status.autopilot, body, status.landed, now, dt);
  status.conditions.rotor_shares.clear();
  for (std::size_t i = 0; i < status.rotor_commands.size() && faults_.any(); ++i) {
    status.conditions.rotor_shares.push_back(faults_.rotor_share(i, now));
  }

  const double error = (body.p_world - status.autopilot.reference.p_world).norm();
  status.squared_error_sum += error * error;
  VehicleSummary& summary = status.summary;
  summary.tracking_error_max = std::max(summary.tracking_error_max, error);
  ++status.steps;
  summary.tracking_error_rms =
      std::sqrt(status.squared_error_sum / static_cast<double>(status.steps));
  summary.speed_max = std::max(summary.speed_max, body.v_world.norm());
  if (status.autopilot.armed && !status.landed) watch_limits(status, step);

  status.conditions.ground_z = ground_below(status);
  if (!wind_.is_calm()) {
    const double height = body.p_world.z() - map.bounds_world().min.z();
    status.conditions.wind_world =
        wind_.over_step(status.gusts, number_, step_number, dt, body.v_world, height);
  }
  if (setup_.battery) {
    status.conditions.speed_share = battery_.step(status.battery, status.state, dt);
    watch_battery(status, now);
  }
}

void VehicleAgent::note(VehicleStatus& status,
                        SimTime now,
                        const char* kind,
                        const std::string& words) const {
  status.events.push_back({number_, now, kind, words, status.state.body.p_world});
}

std::optional<std::string> VehicleAgent::command(VehicleStatus& status,
                                                 const Command& command,
                                                 SimTime now) const {
  AutopilotState& pilot = status.autopilot;
  if (status.summary.battery_low && setup_.on_low_battery == LowBatteryReaction::kLand) {
    return pilot.reject("the battery is low: it lands");
  }
  const auto before = pilot.trajectory;
  if (auto reason = autopilot_.give(pilot, command, now, status.state.body)) return reason;
  const bool given = std::holds_alternative<TrajectoryCommand>(command);
  const bool made = std::holds_alternative<WaypointCommand>(command);
  if ((!given && !made) || pilot.trajectory == before) return std::nullopt;
  const RigidBodyState* from = given ? &status.state.body : nullptr;
  if (const auto words = beyond_limits(*pilot.trajectory, settings(), from)) {
    ++status.summary.beyond_limits;
    note(status, now, "beyond_limits", *words);
  }
  return std::nullopt;
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

void VehicleAgent::watch_limits(VehicleStatus& status, Duration step) const {
  const LimitsReached& reached = status.autopilot.memory.limits;
  VehicleSummary& summary = status.summary;
  if (reached.speed) summary.speed_limited += step;
  if (reached.acceleration) summary.acceleration_limited += step;
  if (reached.tilt) summary.tilt_limited += step;
  if (reached.rotors) summary.rotors_limited += step;
}

void VehicleAgent::watch_battery(VehicleStatus& status, SimTime now) const {
  VehicleSummary& summary = status.summary;
  const double charge = battery_.charge(status.battery);
  const LowBatteryReaction action = setup_.on_low_battery;
  if (!summary.battery_low && charge <= settings().battery.reserve) {
    summary.battery_low = now;
    note(status,
         now,
         "battery_low",
         fmt::format("the battery is down to {:.0f} % after {:.2f} Ah: {}",
                     100.0 * charge,
                     status.battery.used,
                     action == LowBatteryReaction::kLand   ? "it lands"
                     : action == LowBatteryReaction::kFall ? "its rotors stop"
                                                           : "it flies on"));
    if (action == LowBatteryReaction::kLand) {
      autopilot_.give(status.autopilot, LandCommand{}, now, status.state.body);
      status.scripted = false;
    }
  }
  const bool stops = charge <= 0.0 || (summary.battery_low && action == LowBatteryReaction::kFall);
  if (summary.battery_empty || !stops) return;
  summary.battery_empty = now;
  note(status, now, "battery_empty", "the battery gives nothing more: its rotors are off");
}

/// True where something below is as good as touched by a vehicle that is meant to land, or that has
/// its rotors off.
bool VehicleAgent::touches_down(const VehicleStatus& status) const {
  const auto& nearest = status.proximity.nearest;
  const RigidBodyState& body = status.state.body;
  const bool gently = body.v_world.norm() < kTouchdownSpeed;  // else it hits: a collision
  if (!nearest || nearest->label != kMapLabel || nearest->distance > (gently ? kTouchdown : 0.0)) {
    return false;
  }
  const double below = body.p_world.z() - nearest->place_world.z();
  if (below < 0.5 * half_extent(hull_).z() || body.v_world.z() > 0.0) return false;
  return !status.autopilot.armed ||
         (gently && std::holds_alternative<LandCommand>(status.autopilot.command));
}

VehicleState VehicleAgent::state_after(const VehicleStatus& status, double dt) const {
  VehicleState state = status.state;
  if (dt <= 0.0) return state;
  dynamics_.step(state, status.rotor_commands, dt, status.conditions);
  // rotors that run down carry nothing off
  if (status.landed && (state.body.v_world.z() <= 0.0 || !status.autopilot.armed)) {
    state.body = status.state.body;  // the ground holds it
    state.body.v_world.setZero();
    state.body.omega_body.setZero();
  }
  return state;
}

bool VehicleAgent::integrate(VehicleStatus& status, double dt) const {
  const Vector3d before = status.state.body.p_world;
  status.state = state_after(status, dt);
  const RigidBodyState& body = status.state.body;
  if (status.landed && body.v_world.z() > 0.0) status.landed = false;
  status.summary.distance_flown += (body.p_world - before).norm();
  return body.is_finite();
}

void VehicleAgent::crash(VehicleStatus& status) const {
  status.crashed = true;
  status.autopilot.armed = false;
}

BodyAcceleration VehicleAgent::acceleration(const VehicleStatus& status,
                                            const VehicleState& state) const {
  return status.landed ? BodyAcceleration{} : dynamics_.acceleration(state, status.conditions);
}

void VehicleAgent::sample(VehicleStatus& status,
                          SimTime now,
                          SimTime end,
                          StepSamples& samples) const {
  for (VehicleEvent& event : status.events) {
    samples.items.push_back({event.time, kEventRank, std::move(event)});
  }
  status.events.clear();
  const auto arrive = [&](LateSample& late) {
    sensors_[late.sensor].instant->arrive(late.sample, status);
    samples.items.push_back(
        {arrival_of(late.sample), kSensorRank + late.sensor, std::move(late.sample)});
  };
  const auto waits = [&](const LateSample& late) { return arrival_of(late.sample) >= end; };
  const auto first_due = std::stable_partition(status.late.begin(), status.late.end(), waits);
  std::for_each(first_due, status.late.end(), arrive);
  status.late.erase(first_due, status.late.end());
  for (;;) {
    const SimTime next = next_instant(status);
    if (next >= end) return;
    const VehicleState state = state_after(status, to_seconds(next - now));
    if (state_schedule_.at(status.next_state) == next) {
      samples.items.push_back(
          {next,
           kStateRank,
           StateSample{
               number_, next, state, status.autopilot.reference, status.proximity.nearest}});
      ++status.next_state;
      ++status.summary.states;
    }
    for (std::size_t i = 0; i < sensors_.size(); ++i) {
      const InstantSensor* instant = sensors_[i].instant;
      SensorStatus& sensor = status.sensors[i];
      if (instant == nullptr || instant->schedule().at(sensor.next) != next) continue;
      const InstantInput input{sensor.next++, next, state, status, *this};
      LateSample made{i, instant->measure(input, sensor.memory)};
      if (std::holds_alternative<ImuSample>(made.sample)) ++status.summary.imu_samples;
      if (waits(made)) {
        status.late.push_back(std::move(made));
      } else {
        arrive(made);
      }
    }
  }
}

/// When the truth or a sensor is due.
SimTime VehicleAgent::next_instant(const VehicleStatus& status) const {
  SimTime next = state_schedule_.at(status.next_state);
  for (std::size_t i = 0; i < sensors_.size(); ++i) {
    if (sensors_[i].instant == nullptr) continue;
    next = std::min(next, sensors_[i].sensor->schedule().at(status.sensors[i].next));
  }
  return next;
}

}  // namespace pointflight
