#include "pointflight/sim/simulation.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <stdexcept>
#include <tuple>

#include "pointflight/core/constants.hpp"
#include "pointflight/core/input_error.hpp"
#include "pointflight/core/random.hpp"
#include "pointflight/sim/start_check.hpp"

namespace pointflight {
namespace {

constexpr double kGoalTolerance = 0.5;      // m
constexpr double kBeamOrigin = 1.0;         // m: beams start no farther from their sensor
constexpr double kStartRoom = 1.0;          // m that random obstacles keep from starts
constexpr std::size_t kVehiclesAChunk = 4;  // that one thread steps

}  // namespace

/// What does not change in a run; copies of a simulation share it.
struct Simulation::Setup {
  Scenario scenario;
  std::shared_ptr<const SurfelMap> map;
  std::vector<std::unique_ptr<VehicleAgent>> agents;
  Obstacles obstacles;
  Duration step{0};
  SimTime end_time;
  Schedule obstacle_schedule{10.0};
};

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

  std::map<std::string, std::shared_ptr<const Renderer>> renderers;
  const RendererByName renderer = [&](const std::string& name) {
    auto& made = renderers[name];
    if (!made) made = make_renderer(name, Scene{setup->map});
    return made;
  };
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
    setup->agents.push_back(std::make_unique<VehicleAgent>(scenario, i, fleet[i], renderer));
    const VehicleAgent& agent = *setup->agents.back();
    state_.vehicles.push_back(agent.start());
    world.keep_free.push_back({fleet[i].start, bounding_radius(agent.hull()) + kStartRoom});
    busy = std::max(busy, agent.busy_time());
  }
  setup->obstacles = Obstacles(scenario.obstacles, world, executor);
  const double natural = busy > 0.0 ? busy : kIdleTime;
  setup->end_time = SimTime(from_seconds(scenario.duration > 0.0 ? scenario.duration : natural));
  sources_.resize(fleet.size());
  setup_ = std::move(setup);
  for (std::size_t i = 0; i < vehicle_count(); ++i) check_start(i);
}

SimTime Simulation::end_time() const {
  return setup_->scenario.duration > 0.0 ? setup_->end_time
                                         : std::max(setup_->end_time, state_.busy_until);
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
  for (std::size_t i = 0; i < vehicle_count(); ++i) {
    const VehicleAgent& agent = vehicle(i);
    const Pose pose = status(i).state.body.T_world_body();
    const ProximityState& known = status(i).proximity;
    vehicles.push_back({agent.label(),
                        &agent.shape(),
                        bounding_radius(agent.hull()),
                        known.started ? known.T_world_body : pose,
                        pose});
  }
  executor_->parallel_for(
      vehicle_count(), kVehiclesAChunk, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
          VehicleStatus& status = state_.vehicles[i];
          const VehicleAgent& agent = vehicle(i);
          ProximityQuery query;
          query.vehicle = agent.number();
          query.own_label = agent.label();
          query.hull = &agent.hull();
          query.T_world_body = vehicles[i].now;
          query.now = now;
          query.step = setup_->step;
          query.reach = kClearanceReach;
          query.ignores_map = status.landed || status.crashed;
          // obstacles that are near enough to be met or to be the nearest
          const double moved =
              (vehicles[i].now.translation - vehicles[i].before.translation).norm();
          const std::vector<Body> bodies =
              setup_->obstacles.near(query.T_world_body.translation,
                                     vehicles[i].radius + query.reach + moved,
                                     before,
                                     now);
          std::vector<PlacedBody> others = vehicles;
          for (const Body& body : bodies) {
            if (body.until <= now || body.from > now) continue;  // was replaced within the step
            const Pose pose = body.T_world_body(now);
            others.push_back({body.label,
                              &body.shape,
                              bounding_radius(body.shape),
                              body.from > before ? pose : body.T_world_body(before),
                              pose});
          }
          sense_proximity(query, *setup_->map, others, status.proximity, samples[i].collisions);
          const auto& nearest = status.proximity.nearest;
          VehicleSummary& summary = status.summary;
          if (nearest && !status.crashed &&
              (!summary.closest_approach || nearest->distance < *summary.closest_approach)) {
            summary.closest_approach = nearest->distance;
            summary.closest_place_world = nearest->place_world;
            summary.closest_label = nearest->label;
          }
          if (status.crashed) samples[i].collisions.clear();  // it is a wreck already
        }
      });
}

/// Collisions of this step: who stops, who falls. True where the run ends.
bool Simulation::react(std::vector<StepSamples>& samples) {
  bool stops = false;
  for (std::size_t i = 0; i < vehicle_count(); ++i) {
    const VehicleAgent& agent = vehicle(i);
    VehicleStatus& status = state_.vehicles[i];
    for (const CollisionEvent& event : samples[i].collisions) {
      if (!event.entered) continue;
      ++status.summary.collisions;
      if (agent.setup().on_collision == "stop") stops = true;
      if (agent.setup().on_collision == "crash") agent.crash(status);
    }
  }
  return stops;
}

bool Simulation::step(SampleSink& sink) {
  if (state_.end != RunEnd::kRunning) return false;
  const SimTime now = state_.time;
  const double dt = to_seconds(setup_->step);
  std::vector<StepSamples> samples(vehicle_count());
  sense(samples);
  const bool stops = react(samples);
  const bool last = now >= end_time() && !is_landing();
  const SimTime samples_end = stops || last ? now + Duration{1} : now + setup_->step;
  executor_->parallel_for(
      vehicle_count(), kVehiclesAChunk, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
          VehicleStatus& status = state_.vehicles[i];
          status.history.record(now, status.state.body.T_world_body());
          vehicle(i).control(status, *setup_->map, now, setup_->step, state_.step_number);
          vehicle(i).sample(status, now, samples_end, samples[i]);
        }
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
  executor_->parallel_for(
      vehicle_count(), kVehiclesAChunk, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
          if (!sources_[i]) fine[i] = vehicle(i).integrate(state_.vehicles[i], dt) ? 1 : 0;
        }
      });
  for (std::size_t i = 0; i < vehicle_count(); ++i) {
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
  if (setup_->scenario.duration > 0.0) return false;
  return std::any_of(
      state_.vehicles.begin(), state_.vehicles.end(), [](const VehicleStatus& status) {
        return status.commanded && status.autopilot.armed &&
               std::holds_alternative<LandCommand>(status.autopilot.command);
      });
}

/// True where nothing but the lack of commands ends the run: programs gave some, or nobody did.
bool Simulation::is_idle() const {
  if (setup_->scenario.duration > 0.0) return false;
  bool had_plan = false;
  for (std::size_t i = 0; i < vehicle_count(); ++i) {
    if (status(i).commanded) return true;
    had_plan = had_plan || vehicle(i).busy_time() > 0.0;
  }
  return !had_plan;
}

/// All that have a mission and nothing else to do are at their goals; nobody lies broken or empty.
bool Simulation::arrived() const {
  for (std::size_t i = 0; i < vehicle_count(); ++i) {
    const VehicleSetup& setup = vehicle(i).setup();
    if (status(i).crashed || status(i).summary.battery_empty) return false;
    const bool elsewhere = status(i).commanded || !setup.commands.empty();
    if (setup.mission.waypoints.empty() || elsewhere) continue;
    const Mission& mission = vehicle(i).mission();
    const double away = (status(i).state.body.p_world - mission.goal()).norm();
    if (away >= kGoalTolerance || to_seconds(state_.time) < mission.duration()) return false;
  }
  return true;
}

/// Somebody flies where nothing can be measured any more, or falls through a hole in the floor. A
/// wreck that does so ends nothing while others fly.
bool Simulation::has_left_map() const {
  bool flying = false;
  bool lost = false;
  for (std::size_t i = 0; i < vehicle_count(); ++i) {
    const bool is_out = is_lost(*setup_->map, status(i).state.body.p_world);
    if (is_out && !status(i).crashed) return true;
    lost = lost || is_out;
    flying = flying || !status(i).crashed;
  }
  return lost && !flying;
}

/// All vehicles' samples in the order (time, kind, vehicle).
void Simulation::deliver(std::vector<StepSamples>& samples, SampleSink& sink) {
  struct Due {
    SimTime time;
    int kind;
    std::size_t vehicle;
    std::size_t index;
  };
  std::vector<Due> due;
  for (std::size_t v = 0; v < samples.size(); ++v) {
    const StepSamples& s = samples[v];
    for (std::size_t i = 0; i < s.collisions.size(); ++i) {
      due.push_back({s.collisions[i].time, 0, v, i});
    }
    for (std::size_t i = 0; i < s.events.size(); ++i) due.push_back({s.events[i].time, 1, v, i});
    for (std::size_t i = 0; i < s.states.size(); ++i) due.push_back({s.states[i].time, 2, v, i});
    for (std::size_t i = 0; i < s.odometry.size(); ++i) {
      due.push_back({s.odometry[i].delivered, 3, v, i});
    }
    for (std::size_t i = 0; i < s.imu.size(); ++i) due.push_back({s.imu[i].time, 4, v, i});
  }
  std::stable_sort(due.begin(), due.end(), [](const Due& a, const Due& b) {
    return std::tie(a.time, a.kind, a.vehicle) < std::tie(b.time, b.kind, b.vehicle);
  });
  for (const Due& d : due) {
    const StepSamples& s = samples[d.vehicle];
    if (d.kind == 0) sink.on_collision(s.collisions[d.index]);
    if (d.kind == 1) sink.on_vehicle_event(s.events[d.index]);
    if (d.kind == 2) sink.on_state(s.states[d.index]);
    if (d.kind == 3) sink.on_odometry(s.odometry[d.index]);
    if (d.kind == 4) sink.on_imu(static_cast<std::uint32_t>(d.vehicle), s.imu[d.index]);
  }
}

void Simulation::sample_obstacles(SimTime end, SampleSink& sink) {
  if (setup_->obstacles.size() == 0) return;
  for (;; ++state_.next_obstacle_sample) {
    const SimTime time = setup_->obstacle_schedule.at(state_.next_obstacle_sample);
    if (time >= end) return;
    for (const Body& body : obstacles(time, time)) {
      if (time < body.from || time >= body.until) continue;
      ObstacleSample sample;
      sample.time = time;
      sample.label = body.label;
      sample.T_world_body = body.T_world_body(time);
      if (const auto* solid = std::get_if<Solid>(&body.shape)) {
        sample.half_extent = half_extent(*solid);
      }
      sink.on_obstacle(sample);
    }
  }
}

/// What a scan of a vehicle's lidar can meet: everybody else, and the obstacles that are near
/// enough.
std::vector<Body> Simulation::bodies_for_scan(std::size_t number,
                                              const MountedLidar& mounted,
                                              SimTime from,
                                              SimTime until) const {
  const StateHistory& own = status(number).history;
  const SimTime middle = from + (until - from) / 2;
  const double moved = own.speed_max(from, until) * to_seconds(until - middle);
  const double reach =
      mounted.lidar->reach() + mounted.T_body_sensor.translation.norm() + moved + kBeamOrigin;
  std::vector<Body> bodies = setup_->obstacles.near(own.at(middle).translation, reach, from, until);
  for (std::size_t i = 0; i < vehicle_count(); ++i) {
    if (i == number) continue;
    Body body;
    body.label = vehicle(i).label();
    body.shape = vehicle(i).shape();
    body.intensity = static_cast<float>(vehicle(i).settings().intensity);
    body.speed_max = status(i).history.speed_max(from, until);
    body.T_world_body = [&history = status(i).history](SimTime t) { return history.at(t); };
    bodies.push_back(std::move(body));
  }
  return bodies;
}

/// Scans that have ended: rendered in arrears, those that end together at the same time.
void Simulation::take_due_scans(SampleSink& sink) {
  struct Due {
    std::size_t vehicle, lidar;
  };
  for (;;) {
    std::vector<Due> due;
    SimTime first_end = SimTime::max();
    SimTime oldest_needed = state_.time;
    for (std::size_t v = 0; v < vehicle_count(); ++v) {
      for (std::size_t l = 0; l < vehicle(v).lidars().size(); ++l) {
        const Schedule& schedule = vehicle(v).lidars()[l].schedule;
        const std::int64_t number = status(v).next_scan[l];
        const SimTime end = schedule.at(number + 1);
        oldest_needed = std::min(oldest_needed, schedule.at(number));
        if (end > state_.time || end > first_end) continue;
        if (end < first_end) due.clear();
        first_end = end;
        due.push_back({v, l});
      }
    }
    if (due.empty()) {
      for (VehicleStatus& status : state_.vehicles) status.history.forget_before(oldest_needed);
      return;
    }
    std::vector<std::optional<Scan>> scans(due.size());
    executor_->parallel_for(due.size(), 1, [&](std::size_t k, std::size_t) {
      const auto [v, l] = due[k];
      const VehicleAgent& agent = vehicle(v);
      const MountedLidar& mounted = agent.lidars()[l];
      const std::int64_t number = status(v).next_scan[l];
      const SimTime start = mounted.schedule.at(number);
      if (agent.faults().is_dead(l, start)) return;
      const double lost = agent.faults().dropped_share(l, start);
      const RandomStream chance(agent.seed(),
                                StreamId::kDroppedScans,
                                agent.number() << 8 | static_cast<std::uint32_t>(l));
      if (lost > 0.0 && chance.uniform(static_cast<std::uint64_t>(number)) < lost) return;
      const std::vector<Body> bodies = bodies_for_scan(v, mounted, start, first_end);
      const ScanRequest request{static_cast<std::uint64_t>(number),
                                start,
                                mounted.snapshot,
                                mounted.noise,
                                agent.seed(),
                                bodies};
      const StateHistory& history = status(v).history;
      const PoseAt pose_at = [&](SimTime t) { return history.at(t) * mounted.T_body_sensor; };
      scans[k] = mounted.lidar->take(request, pose_at, *mounted.renderer, *executor_);
      scans[k]->vehicle = agent.number();
      scans[k]->sensor = static_cast<std::uint32_t>(l);
    });
    for (std::size_t k = 0; k < due.size(); ++k) {
      const auto [v, l] = due[k];
      VehicleStatus& status = state_.vehicles[v];
      ++status.next_scan[l];
      if (!scans[k]) continue;
      ++status.summary.scans;
      status.summary.beams += scans[k]->beams;
      status.summary.points += scans[k]->points.size();
      const MountedLidar& mounted = vehicle(v).lidars()[l];
      const StateHistory& history = status.history;
      sink.on_scan(*scans[k], [&](SimTime t) { return history.at(t) * mounted.T_body_sensor; });
    }
  }
}

}  // namespace pointflight
