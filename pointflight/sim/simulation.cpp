#include "pointflight/sim/simulation.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <stdexcept>

#include "pointflight/core/constants.hpp"
#include "pointflight/core/input_error.hpp"
#include "pointflight/sim/simulation_setup.hpp"
#include "pointflight/sim/start_check.hpp"

namespace pointflight {
namespace {

constexpr double kGoalTolerance = 0.5;        // m
constexpr double kStartRoom = 1.0;            // m that random obstacles keep from starts
constexpr std::size_t kVehiclesPerChunk = 4;  // that one thread steps

}  // namespace

const char* to_string(RunEnd end) {
  switch (end) {
    case RunEnd::kRunning:
      return "running";
    case RunEnd::kCompleted:
      return "completed";
    case RunEnd::kMissionUnfinished:
      return "mission unfinished";
    case RunEnd::kCollision:
      return "collision";
    case RunEnd::kLeftMap:
      return "left the map";
    case RunEnd::kInterrupted:
      return "interrupted";
    case RunEnd::kIdle:
      return "idle";
  }
  return "";
}

const char* reason_of(RunEnd end) {
  if (end == RunEnd::kIdle) {
    return "nothing left to do, no command for 10 s, and the scenario has no duration";
  }
  if (end == RunEnd::kLeftMap) return "over 50 m beside or below it, or 500 m above";
  return "";
}

Simulation::Simulation(const Scenario& scenario,
                       std::shared_ptr<const SurfelMap> map,
                       const Executor& executor)
    : executor_(&executor) {
  if (!map) throw std::invalid_argument("a simulation needs a map");
  check_settings(scenario, scenario.path.empty() ? "scenario" : scenario.path);
  auto setup = std::make_shared<Setup>();
  setup->scenario = scenario;
  setup->map = std::move(map);
  setup->step = from_seconds(scenario.physics_step);
  setup->obstacle_schedule = Schedule(scenario.output.obstacle_rate);

  SharedParts shared(setup->map, scenario.folder());
  const auto fleet = scenario.fleet();
  if (fleet.empty() || fleet.size() >= kFirstObstacle) {
    throw InputError(fmt::format(
        "{}: {} vehicles; 1 to {}", scenario.place("vehicles"), fleet.size(), kFirstObstacle - 1));
  }
  check_names(scenario, fleet);
  check_reach(scenario, fleet);
  ObstacleWorld world;
  world.map = setup->map;
  world.seed = static_cast<std::uint64_t>(scenario.seed);
  world.folder = scenario.folder();
  world.place = [&](std::size_t entry, const char* key) {
    const std::string name = fmt::format("obstacles[{}].{}", entry, key);
    const std::string item = fmt::format("obstacles[{}]", entry);
    return scenario.place(scenario.lines.contains(name) ? name : item) + ": " + name;
  };
  double busy = 0.0;
  for (std::size_t i = 0; i < fleet.size(); ++i) {
    setup->agents.push_back(std::make_unique<VehicleAgent>(scenario, i, fleet[i], shared));
    const VehicleAgent& agent = *setup->agents.back();
    state_.vehicles.push_back(agent.start());
    world.keep_free.push_back({fleet[i].start, bounding_radius(agent.hull()) + kStartRoom});
    busy = std::max(busy, agent.busy_time());
  }
  setup->obstacles = Obstacles(scenario.obstacles, world, executor);
  const double natural = busy > 0.0 ? busy : kIdleTime;
  setup->end_time = SimTime(from_seconds(scenario.duration > 0.0 ? scenario.duration : natural));
  sources_.resize(fleet.size());
  for (std::size_t i = 0; i < fleet.size(); ++i) own_.push_back(i);
  setup_ = std::move(setup);
  for (std::size_t i = 0; i < vehicle_count(); ++i) check_start(i);
}

SimTime Simulation::end_time() const {
  if (others_ != nullptr && others_->decides_together()) return met_.end_time;
  return own_end_time();
}

/// As far as this process is concerned.
SimTime Simulation::own_end_time() const {
  if (setup_->scenario.duration > 0.0) return setup_->end_time;
  return std::max(setup_->end_time + state_.skipped, state_.busy_until);
}

void Simulation::require_vehicle(std::size_t number) const {
  if (number < vehicle_count()) return;
  throw std::out_of_range(
      fmt::format("vehicle {} of a run with {}; they count from 0", number, vehicle_count()));
}

const Scenario& Simulation::scenario() const {
  return setup_->scenario;
}

const SurfelMap& Simulation::map() const {
  return *setup_->map;
}

const VehicleAgent& Simulation::vehicle(std::size_t number) const {
  require_vehicle(number);
  return *setup_->agents[number];
}

std::shared_ptr<const SurfelMap> Simulation::shared_map() const {
  return setup_->map;
}

const VehicleStatus& Simulation::status(std::size_t number) const {
  require_vehicle(number);
  return state_.vehicles[number];
}

std::size_t Simulation::obstacle_count() const {
  return setup_->obstacles.size();
}

std::vector<Body> Simulation::obstacles(SimTime from, SimTime until) const {
  return setup_->obstacles.bodies(from, until);
}

void Simulation::check_start(std::size_t number) const {
  const auto placed = [&](std::size_t i) {
    return StartingVehicle{&vehicle(i), status(i).state.body.T_world_body()};
  };
  std::vector<StartingVehicle> before;
  for (std::size_t i = 0; i < number; ++i) before.push_back(placed(i));
  const Scenario& scenario = setup_->scenario;
  check_start_is_free(
      scenario, *setup_->map, placed(number), before, obstacles(SimTime{}, SimTime{}), *executor_);
}

std::optional<std::string> Simulation::command(std::size_t vehicle_number, const Command& command) {
  const VehicleAgent& agent = vehicle(vehicle_number);
  if (!is_own(vehicle_number)) return "another process flies it";
  VehicleStatus& status = state_.vehicles[vehicle_number];
  if (auto reason = agent.command(status, command, state_.time)) return reason;
  status.scripted = false;
  status.commanded = true;
  // a landing takes as long as it takes: its trajectory goes on through the ground
  const bool lands = std::holds_alternative<LandCommand>(command);
  const auto& trajectory = status.autopilot.trajectory;
  const double lasts = trajectory && !lands ? trajectory->duration() : 0.0;
  state_.busy_until = std::max(state_.busy_until, state_.time + from_seconds(lasts + kIdleTime));
  return std::nullopt;
}

void Simulation::follow(std::size_t vehicle, std::shared_ptr<StateSource> source) {
  require_vehicle(vehicle);
  sources_[vehicle] = std::move(source);
}

void Simulation::restore(const SimulationState& state) {
  if (state.vehicles.size() != vehicle_count()) {
    throw std::invalid_argument(fmt::format(
        "a state with {} vehicles for a run with {}", state.vehicles.size(), vehicle_count()));
  }
  state_ = state;
}

void Simulation::interrupt() {
  state_.end = RunEnd::kInterrupted;
}

void Simulation::complete() {
  state_.end = RunEnd::kCompleted;
}

bool Simulation::advance_to(SimTime time, SampleSink& sink) {
  while (state_.time < time) {
    if (!step(sink)) return false;
  }
  return state_.end == RunEnd::kRunning;
}

/// What is near each hull, now that everybody is where they are.
void Simulation::sense(std::vector<StepSamples>& samples) {
  const SimTime now = state_.time;
  const SimTime before = state_.step_number > 0 ? now - setup_->step : now;
  std::vector<PlacedBody> vehicles;
  vehicles.reserve(vehicle_count());
  std::vector<PlacedBody> own(vehicle_count());
  for (std::size_t i = 0; i < vehicle_count(); ++i) {
    if (!status(i).present) continue;
    const VehicleAgent& agent = vehicle(i);
    const Pose pose = status(i).state.body.T_world_body();
    const ProximityState& known = status(i).proximity;
    vehicles.push_back({agent.label(),
                        &agent.shape(),
                        bounding_radius(agent.hull()),
                        known.started ? known.T_world_body : pose,
                        pose});
    own[i] = vehicles.back();
  }
  executor_->parallel_for(own_.size(), kVehiclesPerChunk, [&](std::size_t begin, std::size_t end) {
    std::vector<PlacedBody> bodies = vehicles;
    for (std::size_t k = begin; k < end; ++k) {
      bodies.resize(vehicles.size());  // without the obstacles near the one before
      sense_one(own_[k], before, own[own_[k]], bodies, samples[own_[k]]);
    }
  });
}

/// An action for each own vehicle, by all threads.
void Simulation::for_own(const std::function<void(std::size_t)>& action) const {
  executor_->parallel_for(own_.size(), kVehiclesPerChunk, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) action(own_[k]);
  });
}

/// What is near one hull. `bodies`: all vehicles where they are; obstacles are added.
void Simulation::sense_one(std::size_t number,
                           SimTime before,
                           const PlacedBody& own,
                           std::vector<PlacedBody>& bodies,
                           StepSamples& samples) {
  const SimTime now = state_.time;
  VehicleStatus& status = state_.vehicles[number];
  const VehicleAgent& agent = vehicle(number);
  ProximityQuery query;
  query.vehicle = agent.number();
  query.own_label = agent.label();
  query.hull = &agent.hull();
  query.T_world_body = own.now;
  query.now = now;
  query.step = setup_->step;
  query.reach = kClearanceReach;
  query.ignores_map = status.landed || status.crashed;
  // obstacles that are near enough to be met or to be the nearest
  const double moved = (own.now.translation - own.before.translation).norm();
  const std::vector<Body> near =
      setup_->obstacles.near(own.now.translation, own.radius + query.reach + moved, before, now);
  for (const Body& body : near) {
    if (body.until <= now || body.from > now) continue;  // was replaced within the step
    const Pose pose = body.T_world_body(now);
    bodies.push_back({body.label,
                      &body.shape,
                      bounding_radius(body.shape),
                      body.from > before ? pose : body.T_world_body(before),
                      pose});
  }
  sense_proximity(query, *setup_->map, bodies, status.proximity, samples.collisions);
  const auto& nearest = status.proximity.nearest;
  VehicleSummary& summary = status.summary;
  if (nearest && !status.crashed &&
      (!summary.closest_approach || nearest->distance < *summary.closest_approach)) {
    summary.closest_approach = nearest->distance;
    summary.closest_place_world = nearest->place_world;
    summary.closest_label = nearest->label;
  }
  if (status.crashed) samples.collisions.clear();  // it is a wreck already
}

/// Collisions of this step: who stops, who falls. True where the run ends.
bool Simulation::react(std::vector<StepSamples>& samples) {
  bool stops = false;
  for (const std::size_t i : own_) {
    const VehicleAgent& agent = vehicle(i);
    VehicleStatus& status = state_.vehicles[i];
    for (const CollisionEvent& event : samples[i].collisions) {
      if (!event.entered) continue;
      ++status.summary.collisions;
      if (agent.setup().on_collision == CollisionReaction::kStop) stops = true;
      if (agent.setup().on_collision == CollisionReaction::kCrash) agent.crash(status);
    }
  }
  return stops;
}

bool Simulation::step(SampleSink& sink) {
  if (state_.end != RunEnd::kRunning) return false;
  const SimTime now = state_.time;
  const double dt = to_seconds(setup_->step);
  std::vector<StepSamples> samples(vehicle_count());
  if (others_ != nullptr) meet_others();
  sense(samples);
  if (others_ != nullptr) {
    for (std::size_t i = 0; i < vehicle_count(); ++i) {
      if (!is_own(i)) place_other(i);
    }
  }
  const bool met_something = react(samples);
  const bool last = now >= end_time() && !is_landing();
  const bool stops = agree(met_something, last);
  const SimTime samples_end = stops || last ? now + Duration{1} : now + setup_->step;
  for_own([&](std::size_t i) {
    VehicleStatus& status = state_.vehicles[i];
    status.history.record(now, status.state.body.T_world_body());
    vehicle(i).control(status, *setup_->map, now, setup_->step, state_.step_number);
    vehicle(i).sample(status, now, samples_end, samples[i]);
  });
  deliver(samples, sink);
  sample_obstacles(samples_end, sink);
  take_due_scans(sink);
  if (stops) {
    state_.end = RunEnd::kCollision;
    return false;
  }
  if (last) {
    finish_run();
    return false;
  }
  if (has_left_map()) {
    state_.end = RunEnd::kLeftMap;
    return false;
  }
  std::vector<char> fine(vehicle_count(), 1);
  for_own([&](std::size_t i) {
    if (!sources_[i]) fine[i] = vehicle(i).integrate(state_.vehicles[i], dt) ? 1 : 0;
  });
  for (const std::size_t i : own_) {
    if (sources_[i]) {
      VehicleStatus& status = state_.vehicles[i];
      const auto state = sources_[i]->state_at(now + setup_->step);
      if (state && state->is_finite()) {
        status.summary.distance_flown += (state->p_world - status.state.body.p_world).norm();
        status.state.body = *state;
      }
    }
    if (fine[i] != 0) continue;
    throw InputError(fmt::format(
        "{}: the dynamics of {} diverged at {:.3f} s; give a smaller physics_step or softer loops",
        setup_->scenario.place("physics_step"),
        vehicle(i).setup().name,
        to_seconds(now)));
  }
  state_.time = now + setup_->step;
  ++state_.step_number;
  sample_status(sink);
  return true;
}

void Simulation::finish_run() {
  if (!arrived()) {
    state_.end = RunEnd::kMissionUnfinished;
  } else {
    state_.end = is_idle() ? RunEnd::kIdle : RunEnd::kCompleted;
  }
}

/// True while a vehicle comes down at a program's word in a run without a duration.
bool Simulation::is_landing() const {
  // as it was told: all processes must see the same last step
  if (others_ != nullptr) return met_.is_landing;
  return setup_->scenario.duration <= 0.0 && lands();
}

/// An own vehicle comes down at a program's word.
bool Simulation::lands() const {
  return std::any_of(own_.begin(), own_.end(), [this](std::size_t i) {
    const VehicleStatus& s = status(i);
    return s.commanded && s.autopilot.armed &&
           std::holds_alternative<LandCommand>(s.autopilot.command);
  });
}

/// True where nothing but the lack of commands ends the run: programs gave some, or nobody did.
bool Simulation::is_idle() const {
  if (setup_->scenario.duration > 0.0) return false;
  bool had_plan = false;
  for (std::size_t i = 0; i < vehicle_count(); ++i) {
    if (is_judged(i) && is_commanded(i)) return true;
    had_plan = had_plan || vehicle(i).busy_time() > 0.0;
  }
  return !had_plan;
}

/// All that have a mission and nothing else to do are at their goals; nobody lies broken or empty.
bool Simulation::arrived() const {
  for (std::size_t i = 0; i < vehicle_count(); ++i) {
    if (is_judged(i) && !(is_own(i) ? has_arrived(i) : met_.vehicles[i]->arrived)) return false;
  }
  return true;
}

/// The same of an own vehicle.
bool Simulation::has_arrived(std::size_t number) const {
  const VehicleSetup& setup = vehicle(number).setup();
  const VehicleStatus& s = status(number);
  if (s.crashed || s.summary.battery_empty) return false;
  const bool elsewhere = s.commanded || !setup.commands.empty();
  if (setup.mission.waypoints.empty() || elsewhere) return true;
  const Mission& mission = vehicle(number).mission();
  const double away = (s.state.body.p_world - mission.goal()).norm();
  return away < kGoalTolerance && to_seconds(state_.time - s.skipped) >= mission.duration();
}

/// Somebody flies where nothing can be measured any more, or falls through a hole in the floor. A
/// wreck that does so ends nothing while others fly.
bool Simulation::has_left_map() const {
  bool flying = false;
  bool lost = false;
  for (std::size_t i = 0; i < vehicle_count(); ++i) {
    if (!is_judged(i)) continue;
    const bool is_out = is_lost(*setup_->map, status(i).state.body.p_world);
    if (is_out && !status(i).crashed) return true;
    lost = lost || is_out;
    flying = flying || !status(i).crashed;
  }
  return lost && !flying;
}

}  // namespace pointflight
