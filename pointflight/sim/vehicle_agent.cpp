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

constexpr double kTouchdown = 0.01;          // m above what carries a vehicle that lands
constexpr double kTouchdownSpeed = 3.0;      // m/s
constexpr double kSpinningDescent = 1.0;     // m/s
constexpr double kGroundEffectReach = 10.0;  // propeller radii

}  // namespace

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

Body VehicleAgent::body() const {
  Body body;
  body.label = label();
  body.shape = shape();
  body.look = look();
  body.intensity = static_cast<float>(settings().intensity);
  return body;
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
  while (status.next_command < commands_.size() &&
         commands_[status.next_command].time + status.skipped <= now) {
    command(status, commands_[status.next_command++].command, now);
    status.scripted = true;
  }
  // whatever it is told
  if (status.crashed || status.summary.battery_empty) status.autopilot.armed = false;
  // a level that must be repeated is, by the scenario
  if (status.scripted && status.autopilot.command.index() < std::variant_size_v<Setpoint>) {
    status.autopilot.since = now;
  }
  std::vector<double>& shares = status.conditions.rotor_shares;
  shares.clear();
  for (std::size_t i = 0; i < status.rotor_commands.size() && faults_.any(); ++i) {
    shares.push_back(faults_.rotor_share(i, now));
  }
  if (settings().controller.reallocate) status.autopilot.memory.rotor_shares = shares;
  if (step_number % control_steps_ == 0) {
    const double period = static_cast<double>(control_steps_) * dt;
    status.rotor_commands =
        autopilot_.rotor_speeds(status.autopilot, believed(status), status.landed, now, period);
  }
  if (status.autopilot.memory.spins) come_down_spinning(status, now);

  const double error = (body.p_world - status.autopilot.reference.p_world).norm();
  status.squared_error_sum += error * error;
  VehicleSummary& summary = status.summary;
  summary.tracking_error_max = std::max(summary.tracking_error_max, error);
  ++status.steps;
  summary.tracking_error_rms =
      std::sqrt(status.squared_error_sum / static_cast<double>(status.steps));
  summary.speed_max = std::max(summary.speed_max, body.v_world.norm());
  if (status.autopilot.armed && !status.landed) {
    watch_limits(status, step);
    watch_track(status, error, now, step);
  }

  status.conditions.ground_z = ground_below(status);
  if (!wind_.is_calm()) {
    const double height = body.p_world.z() - map.bounds_world().min.z();
    status.conditions.wind_world =
        wind_.over_step(status.gusts, number_, step_number, dt, body.v_world, height);
  }
  if (setup_.battery) {
    status.conditions.speed_share =
        battery_.step(status.battery, dynamics_.shaft_power(status.state, status.conditions), dt);
    watch_battery(status, now);
  }
}

RigidBodyState VehicleAgent::believed(const VehicleStatus& status) const {
  if (setup_.controller_input == ControllerInput::kTruth) return status.state.body;
  return status.estimate.on(status.state.body);
}

void VehicleAgent::note(VehicleStatus& status,
                        SimTime now,
                        const char* kind,
                        const std::string& words) const {
  VehicleEvent event;
  event.vehicle = number_;
  event.time = now;
  event.kind = kind;
  event.words = words;
  event.vehicle_world = status.state.body.p_world;
  status.events.push_back(std::move(event));
}

std::optional<std::string> VehicleAgent::command(VehicleStatus& status,
                                                 const Command& command,
                                                 SimTime now) const {
  AutopilotState& pilot = status.autopilot;
  if (status.summary.battery_low && setup_.on_low_battery == LowBatteryReaction::kLand) {
    return pilot.reject("the battery is low: it lands");
  }
  if (status.summary.rotor_lost) return pilot.reject("a rotor is lost: it lands");
  const auto before = pilot.trajectory;
  const RigidBodyState body = believed(status);
  if (auto reason = autopilot_.give(pilot, command, now, body)) return reason;
  const bool given = std::holds_alternative<TrajectoryCommand>(command);
  const bool made = std::holds_alternative<WaypointCommand>(command);
  if ((!given && !made) || pilot.trajectory == before) return std::nullopt;
  const RigidBodyState* from = given ? &body : nullptr;
  if (const auto words = beyond_limits(*pilot.trajectory, settings(), from)) {
    ++status.summary.beyond_limits;
    note(status, now, "beyond_limits", *words);
  }
  return std::nullopt;
}

void VehicleAgent::come_down_spinning(VehicleStatus& status, SimTime now) const {
  if (status.summary.rotor_lost) return;
  status.summary.rotor_lost = now;
  const auto& shares = status.conditions.rotor_shares;
  const auto weakest = std::min_element(shares.begin(), shares.end());
  note(status,
       now,
       "rotor_lost",
       fmt::format("rotor {} turns at {:.0f} % of its speed: the others cannot hold a heading; it "
                   "lands, spinning",
                   weakest - shares.begin(),
                   100.0 * *weakest));
  autopilot_.give(status.autopilot, LandCommand{kSpinningDescent}, now, believed(status));
  status.scripted = false;
}

void VehicleAgent::watch_limits(VehicleStatus& status, Duration step) const {
  const LimitsReached& reached = status.autopilot.memory.limits;
  VehicleSummary& summary = status.summary;
  if (reached.speed) summary.speed_limited += step;
  if (reached.acceleration) summary.acceleration_limited += step;
  if (reached.tilt) summary.tilt_limited += step;
  if (reached.rotors) summary.rotors_limited += step;
}

/// A mission, a trajectory or a hover is a way that it should be on; a position far away that it is
/// sent to is none.
void VehicleAgent::watch_track(VehicleStatus& status,
                               double error,
                               SimTime now,
                               Duration step) const {
  constexpr double kOff = 3.0;   // m
  constexpr double kBack = 1.0;  // m
  const bool has_way = status.autopilot.trajectory != nullptr || status.autopilot.hold.has_value();
  if (!has_way || error < kBack) {
    status.off_track = false;
    return;
  }
  if (error < kOff) return;
  status.summary.off_track += step;
  if (std::exchange(status.off_track, true)) return;
  note(status,
       now,
       "off_track",
       fmt::format("is {:.1f} m from where it should be{}",
                   error,
                   status.conditions.wind_world.norm() > 1.0
                       ? fmt::format(" in wind of {:.0f} m/s", status.conditions.wind_world.norm())
                       : std::string()));
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
      autopilot_.give(status.autopilot, LandCommand{}, now, believed(status));
      status.scripted = false;
    }
  }
  const bool stops = charge <= 0.0 || (summary.battery_low && action == LowBatteryReaction::kFall);
  if (summary.battery_empty || !stops) return;
  summary.battery_empty = now;
  note(status, now, "battery_empty", "the battery gives nothing more: its rotors are off");
}

/// True if something below is as good as touched by a vehicle that is meant to land, or that has
/// its rotors off.
bool VehicleAgent::touches_down(const VehicleStatus& status) const {
  const auto& nearest = status.proximity.nearest;
  const RigidBodyState& body = status.state.body;
  const bool gently = body.v_world.norm() < kTouchdownSpeed;  // else it hits: a collision
  if (!nearest || nearest->label != kMapLabel || nearest->distance > (gently ? kTouchdown : 0.0)) {
    return false;
  }
  const double below = body.p_world.z() - nearest->position_world.z();
  if (below < 0.5 * half_extent(hull_).z() || body.v_world.z() > 0.0) return false;
  // who sets rotor speeds himself has no other way to say that he lands
  const Command& told = status.autopilot.command;
  const bool may_land =
      std::holds_alternative<LandCommand>(told) || std::holds_alternative<RotorSpeedCommand>(told);
  return !status.autopilot.armed || (gently && may_land);
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

void VehicleAgent::resume(VehicleStatus& status, const VehicleState& state, SimTime time) const {
  status.state = state;
  for (std::size_t i = 0; i < state.rotors.size(); ++i) {
    status.rotor_commands[i] = state.rotors[i].speed;
  }
  const bool rotors_stand = std::all_of(
      state.rotors.begin(), state.rotors.end(), [](const RotorState& r) { return r.speed < 1.0; });
  status.landed = setup_.landed && (state.body.p_world - setup_.start).norm() < kTouchdown;
  while (status.next_command < commands_.size() &&
         commands_[status.next_command].time + status.skipped <= time) {
    const TimedCommand& given = commands_[status.next_command++];
    // ways that are made from where it is begin here; those that are given are half flown
    const bool is_given = std::holds_alternative<TrajectoryCommand>(given.command);
    command(status, given.command, is_given ? given.time + status.skipped : time);
    status.scripted = true;
  }
  if (!rotors_stand || status.landed) return;
  const Command& last = status.autopilot.command;
  if (std::holds_alternative<LandCommand>(last) || std::holds_alternative<DisarmCommand>(last)) {
    status.landed = true;  // as it was told
  } else {
    crash(status);  // it lies where it fell
  }
}

void VehicleAgent::move_schedules_to(VehicleStatus& status, SimTime time) const {
  status.late.clear();
  status.next_state = state_schedule_.first_from(time);
  for (std::size_t i = 0; i < sensors_.size(); ++i) {
    status.sensors[i].next = sensors_[i].sensor->schedule().first_from(time);
  }
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
    if (const auto* odometry = std::get_if<OdometrySample>(&late.sample)) {
      status.estimate = odometry->error;
    }
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
      samples.items.push_back({next,
                               kStateRank,
                               StateSample{number_,
                                           next,
                                           state,
                                           status.autopilot.reference,
                                           status.proximity.nearest,
                                           status.skipped}});
      ++status.next_state;
      ++status.summary.states;
    }
    for (std::size_t i = 0; i < sensors_.size(); ++i) {
      const InstantSensor* instant = sensors_[i].instant;
      SensorStatus& sensor = status.sensors[i];
      if (instant == nullptr || instant->schedule().at(sensor.next) != next) continue;
      if (instant->loses(sensor.next)) {
        ++sensor.next;
        continue;
      }
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
