#include "pointflight/sim/simulation.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <stdexcept>

#include "pointflight/core/argument.hpp"
#include "pointflight/core/constants.hpp"
#include "pointflight/core/input_error.hpp"
#include "pointflight/sim/neighbourhood.hpp"
#include "pointflight/sim/sensing.hpp"
#include "pointflight/sim/start_check.hpp"

namespace pointflight {
namespace {

constexpr double kGoalTolerance = 0.5;  // m
constexpr double kStartRoom = 1.0;      // m that random obstacles keep from starts

}  // namespace

/// What does not change in a run; copies of a simulation share it.
struct Simulation::Setup {
  Scenario scenario;
  std::shared_ptr<const SurfelMap> map;
  Obstacles obstacles;
  Duration step{0};
  SimTime end_time;
  Schedule obstacle_schedule{10.0};
};

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
    throw InputError(fmt::format("{}: {} vehicles; 1 to {}",
                                 scenario.location("vehicles"),
                                 fleet.size(),
                                 kFirstObstacle - 1));
  }
  check_names(scenario, fleet);
  check_reach(scenario, fleet);
  ObstacleWorld world = scenario.obstacle_world(setup->map);
  double busy = 0.0;
  std::vector<std::shared_ptr<const VehicleAgent>> agents;
  for (std::size_t i = 0; i < fleet.size(); ++i) {
    agents.push_back(std::make_shared<const VehicleAgent>(scenario, i, fleet[i], shared));
    const VehicleAgent& agent = *agents.back();
    state_.vehicles.push_back(agent.start());
    world.keep_free.push_back({fleet[i].start, bounding_radius(agent.hull()) + kStartRoom});
    busy = std::max(busy, agent.busy_time());
  }
  setup->obstacles = Obstacles(scenario.obstacles, world, executor);
  const double natural = busy > 0.0 ? busy : kIdleTime;
  setup->end_time = SimTime(from_seconds(scenario.duration > 0.0 ? scenario.duration : natural));
  setup_ = std::move(setup);
  fleet_ = Fleet(std::move(agents));
  costs_ = std::make_shared<SensorCosts>(fleet_);
  for (std::size_t i = 0; i < vehicle_count(); ++i) check_start(i);
}

const Scenario& Simulation::scenario() const {
  return setup_->scenario;
}

const SurfelMap& Simulation::map() const {
  return *setup_->map;
}

const VehicleAgent& Simulation::vehicle(std::size_t number) const {
  return fleet_.vehicle(number);
}

std::shared_ptr<const SurfelMap> Simulation::shared_map() const {
  return setup_->map;
}

const VehicleStatus& Simulation::status(std::size_t number) const {
  return state_.vehicles[fleet_.vehicle(number).number()];  // throws without such a vehicle
}

std::size_t Simulation::obstacle_count() const {
  return setup_->obstacles.size();
}

std::vector<Body> Simulation::obstacles(SimTime from, SimTime until) const {
  // what replaces what has left is drawn one after the other, up to there
  require_argument(from <= until && until - state_.time <= from_seconds(kLongestRun),
                   "obstacles: from an instant to a later one, at most 1e6 s ahead");
  return setup_->obstacles.bodies(from, until);
}

std::vector<Body> Simulation::bodies() const {
  std::vector<Body> bodies = obstacles(state_.time, state_.time);
  for (std::size_t i = 0; i < vehicle_count(); ++i) {
    if (!status(i).present) continue;
    bodies.push_back(vehicle(i).body());
    bodies.back().motion = PoseTrack(status(i).state.body.T_world_body());
  }
  return bodies;
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
  if (!flies_here(vehicle_number)) return "another process flies it";
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

void Simulation::follow(std::size_t vehicle, std::shared_ptr<VehicleSource> source) {
  fleet_.follow(vehicle, std::move(source));
  state_.vehicles[vehicle].present = flies_here(vehicle);
}

void Simulation::agree_by(EndingAgreement* agreement) {
  agreement_ = agreement;
  agreed_end_ = outlook().end_time;
}

std::vector<SourceReport> Simulation::source_reports() const {
  std::vector<SourceReport> reports;
  for (std::size_t i = 0; i < vehicle_count(); ++i) {
    const VehicleSource* source = fleet_.source(i);
    if (auto report = source != nullptr ? source->report() : std::nullopt) {
      reports.push_back(*std::move(report));
    }
  }
  return reports;
}

void Simulation::restore(const SimulationState& state) {
  if (state.vehicles.size() != vehicle_count()) {
    throw std::invalid_argument(fmt::format(
        "a state with {} vehicles for a run with {}", state.vehicles.size(), vehicle_count()));
  }
  state_ = state;
}

void Simulation::interrupt() {
  state_.ending = {RunEnd::kInterrupted, state_.time};
}

void Simulation::complete() {
  state_.ending = {RunEnd::kCompleted, state_.time};
}

bool Simulation::advance_to(SimTime time, SampleSink& sink) {
  while (state_.time < time) {
    if (!step(sink)) return false;
  }
  return !state_.ending.is_over();
}

bool Simulation::step(SampleSink& sink) {
  if (state_.ending.is_over()) return false;
  const SimTime now = state_.time;
  std::vector<VehicleStatus>& vehicles = state_.vehicles;
  std::vector<StepSamples> samples(vehicle_count());
  fleet_.place(vehicles, now);
  sense_neighbourhood({fleet_, *setup_->map, setup_->obstacles, setup_->step, kClearanceReach},
                      now,
                      state_.step_number == 0,
                      vehicles,
                      samples,
                      *executor_);
  state_.ending = judge(react(samples));
  // the last step is an instant
  const SimTime until = state_.ending.is_over() ? now + Duration{1} : now + setup_->step;
  act(until, samples);
  for (VehicleEvent& event : fleet_.take_events()) {
    samples[event.vehicle].items.push_back({event.time, kEventRank, event});
  }
  deliver(samples, sink);
  sample_obstacles(until, sink);
  sense_intervals(fleet_, setup_->obstacles, now, vehicles, *costs_, sink, *executor_);
  if (state_.ending.is_over()) return false;
  advance();
  sample_status(sink);
  return true;
}

/// Collisions of this step: who stops, who falls. True if one of them ends the run.
bool Simulation::react(std::vector<StepSamples>& samples) {
  bool stops = false;
  for (const std::size_t i : flying_here()) {
    VehicleStatus& status = state_.vehicles[i];
    const VehicleAgent& agent = vehicle(i);
    for (const CollisionEvent& event : samples[i].collisions) {
      if (!event.entered) continue;
      ++status.summary.collisions;
      if (agent.setup().on_collision == CollisionReaction::kStop) stops = true;
      if (agent.setup().on_collision == CollisionReaction::kCrash) agent.crash(status);
    }
  }
  return stops;
}

/// Whether the run ends in this step; `stops`: because of a collision.
Ending Simulation::judge(bool stops) {
  RunOutlook outlook = this->outlook();
  outlook.stops = stops;
  if (agreement_ != nullptr) {
    outlook = agreement_->agree(outlook);
    agreed_end_ = outlook.end_time;
  }
  return ending_of(outlook, state_.time);
}

/// Vehicles control themselves, and say what falls due before `until`.
void Simulation::act(SimTime until, std::vector<StepSamples>& samples) {
  const SimTime now = state_.time;
  fleet_.for_each_here(*executor_, [&](std::size_t i) {
    VehicleStatus& status = state_.vehicles[i];
    status.history.record(now, status.state.body.T_world_body());
    vehicle(i).control(status, *setup_->map, now, setup_->step, state_.step_number);
    vehicle(i).sample(status, now, until, samples[i]);
  });
}

/// The physics of the step.
void Simulation::advance() {
  fleet_.integrate(state_.vehicles,
                   state_.time,
                   to_seconds(setup_->step),
                   setup_->scenario.location("physics_step"),
                   *executor_);
  state_.time += setup_->step;
  ++state_.step_number;
}

SimTime Simulation::end_time() const {
  if (agreement_ != nullptr) return agreed_end_;
  if (setup_->scenario.duration > 0.0) return setup_->end_time;
  return std::max(setup_->end_time + state_.skipped, state_.busy_until);
}

RunOutlook Simulation::outlook() const {
  RunOutlook outlook;
  outlook.has_duration = setup_->scenario.duration > 0.0;
  outlook.may_end_early = setup_->scenario.unfinished == Unfinished::kTimeUp;
  outlook.end_time = outlook.has_duration
                         ? setup_->end_time
                         : std::max(setup_->end_time + state_.skipped, state_.busy_until);
  outlook.is_landing = !outlook.has_duration && is_landing();
  outlook.vehicles.resize(vehicle_count());
  for (const std::size_t i : flying_here()) {
    const VehicleStatus& s = status(i);
    outlook.vehicles[i] = {.has_plan = vehicle(i).busy_time() > 0.0,
                           .arrived = has_arrived(i),
                           .commanded = s.commanded,
                           .crashed = s.crashed,
                           .is_lost = is_lost(*setup_->map, s.state.body.p_world)};
  }
  return outlook;
}

/// A vehicle that flies here comes down at a program's word.
bool Simulation::is_landing() const {
  const auto& here = flying_here();
  return std::any_of(here.begin(), here.end(), [this](std::size_t i) {
    const VehicleStatus& s = status(i);
    return s.commanded && s.autopilot.armed &&
           std::holds_alternative<LandCommand>(s.autopilot.command);
  });
}

/// Nothing is left of a vehicle's mission, and it is neither broken nor empty.
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

void Simulation::move_schedules_to(SimTime time) {
  if (time < state_.time || time - state_.time > from_seconds(kLongestRun) ||
      time.time_since_epoch() % setup_->step != Duration{0}) {
    throw std::invalid_argument(
        fmt::format("from {} s to {} s: not a whole number of steps ahead, at most 1e6 s",
                    to_seconds(state_.time),
                    to_seconds(time)));
  }
  state_.time = time;
  state_.step_number = static_cast<std::uint64_t>(time.time_since_epoch() / setup_->step);
  state_.next_obstacle_sample = setup_->obstacle_schedule.first_from(time);
  state_.next_status = Schedule(kStatusRate).first_from(time);
  for (const std::size_t i : flying_here()) {
    vehicle(i).move_schedules_to(state_.vehicles[i], time);
  }
}

void Simulation::skip_to(SimTime time) {
  if (time == state_.time) return;
  const Duration by = time - state_.time;
  move_schedules_to(time);
  state_.skipped += by;
  state_.busy_until += by;
  for (VehicleStatus& s : state_.vehicles) {  // nobody has flown through what lies between
    s.history.clear();
    s.proximity = {};
    s.present_since = time;
  }
  for (const std::size_t i : flying_here()) {
    state_.vehicles[i].skipped += by;
    state_.vehicles[i].autopilot.since += by;
  }
}

void Simulation::resume_at(SimTime time,
                           Duration skipped,
                           const std::map<std::size_t, VehicleState>& states) {
  move_schedules_to(time);
  state_.skipped = skipped;
  state_.earlier = time.time_since_epoch() - skipped;
  for (const std::size_t i : flying_here()) state_.vehicles[i].skipped = skipped;
  for (const auto& [number, state] : states) {
    vehicle(number).resume(state_.vehicles[number], state, time);
  }
}

void Simulation::sample_obstacles(SimTime until, SampleSink& sink) {
  if (setup_->obstacles.size() == 0) return;
  for (;; ++state_.next_obstacle_sample) {
    const SimTime time = setup_->obstacle_schedule.at(state_.next_obstacle_sample);
    if (time >= until) return;
    ObstacleSample sample;
    sample.time = time;
    for (Body& body : obstacles(time, time)) {
      if (time < body.from || time >= body.until) continue;
      sample.obstacles.push_back({body.label, body.T_world_body(time), std::move(body.shape)});
    }
    if (!sample.obstacles.empty()) sink.on_sample(sample);
  }
}

StatusSample Simulation::status_sample(std::size_t number) const {
  const VehicleStatus& status = this->status(number);
  StatusSample sample;
  sample.vehicle = vehicle(number).number();
  sample.time = state_.time;
  sample.state = status.state.body;
  sample.crashed = status.crashed;
  sample.landed = status.landed;
  sample.touches = !status.proximity.touching.empty();
  sample.armed = status.autopilot.armed;
  sample.command = name_of(status.autopilot.command);
  if (status.proximity.nearest) sample.clearance = status.proximity.nearest->distance;
  sample.collisions = status.summary.collisions;
  sample.scans = status.summary.scans;
  sample.rejected = status.autopilot.rejected;
  sample.last_rejection = status.autopilot.last_rejection;
  sample.timeouts = status.autopilot.timeouts;
  return sample;
}

/// After a step that came to an instant of the schedule.
void Simulation::sample_status(SampleSink& sink) {
  const Schedule schedule(kStatusRate);
  if (schedule.at(state_.next_status) > state_.time) return;
  while (schedule.at(state_.next_status) <= state_.time) ++state_.next_status;
  for (std::size_t v = 0; v < vehicle_count(); ++v) {
    if (status(v).present) sink.on_sample(status_sample(v));
  }
}

}  // namespace pointflight
