// What a run hands to its sinks: samples of vehicles, obstacles, scans.
#include <algorithm>
#include <tuple>

#include "pointflight/core/random.hpp"
#include "pointflight/sim/simulation_setup.hpp"

namespace pointflight {
namespace {

constexpr double kBeamOrigin = 1.0;  // m: beams start no farther from their sensor

}  // namespace

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
