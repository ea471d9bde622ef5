// What a run hands to its sinks: samples of vehicles, obstacles, scans.
#include <algorithm>
#include <tuple>

#include "pointflight/sim/simulation_setup.hpp"

namespace pointflight {
namespace {

constexpr double kBeamOrigin = 1.0;  // m: beams start no farther from their sensor

}  // namespace

/// All vehicles' samples in the order (time, rank, vehicle).
void Simulation::deliver(std::vector<StepSamples>& samples, SampleSink& sink) {
  if (others_ != nullptr) {
    for (VehicleEvent& event : others_->take_events()) {
      StepSamples& of_vehicle = samples[event.vehicle];
      const SimTime time = event.time;
      of_vehicle.items.push_back({time, kEventRank, std::move(event)});
    }
  }
  std::vector<StepSamples::Item*> due;
  for (StepSamples& s : samples) {
    for (CollisionEvent& event : s.collisions)
      s.items.push_back({event.time, kCollisionRank, event});
  }
  // vehicles in their order, which sorting keeps
  for (StepSamples& s : samples) {
    for (StepSamples::Item& item : s.items) due.push_back(&item);
  }
  std::stable_sort(due.begin(), due.end(), [](const auto* a, const auto* b) {
    return std::tie(a->time, a->rank) < std::tie(b->time, b->rank);
  });
  for (const StepSamples::Item* item : due) sink.on_sample(item->sample);
}

void Simulation::sample_obstacles(SimTime end, SampleSink& sink) {
  if (setup_->obstacles.size() == 0) return;
  for (;; ++state_.next_obstacle_sample) {
    const SimTime time = setup_->obstacle_schedule.at(state_.next_obstacle_sample);
    if (time >= end) return;
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

/// What a sensor of a vehicle can meet: everybody else, and the obstacles that are near enough.
/// `tracks` of all vehicles.
std::vector<Body> Simulation::bodies_for(std::size_t number,
                                         const IntervalSensor& sensor,
                                         std::span<const PoseTrack> tracks,
                                         SimTime from,
                                         SimTime until) const {
  const PoseTrack& own = tracks[number];
  const SimTime middle = from + (until - from) / 2;
  const double moved = own.speed_max(from, until) * to_seconds(until - middle);
  std::vector<Body> bodies = setup_->obstacles.near(
      own.at(middle).translation, sensor.reach() + moved + kBeamOrigin, from, until);
  for (std::size_t i = 0; i < vehicle_count(); ++i) {
    if ((i == number && !sensor.sees_own_vehicle()) || !status(i).present) continue;
    Body body;
    body.label = vehicle(i).label();
    body.shape = vehicle(i).shape();
    body.look = vehicle(i).look();
    body.intensity = static_cast<float>(vehicle(i).settings().intensity);
    body.speed_max = tracks[i].speed_max(from, until);
    body.motion = tracks[i];
    body.from = status(i).present_since;
    bodies.push_back(std::move(body));
  }
  return bodies;
}

/// What has ended and is to be measured; those that end first, at the same instant.
std::vector<Simulation::DueInterval> Simulation::due_intervals() {
  std::vector<DueInterval> due;
  SimTime first_end = SimTime::max();
  SimTime oldest_needed = state_.time;
  for (const std::size_t v : own_) {
    const auto sensors = vehicle(v).sensors();
    for (std::size_t i = 0; i < sensors.size(); ++i) {
      const IntervalSensor* sensor = sensors[i].interval;
      if (sensor == nullptr) continue;
      const std::int64_t number = status(v).sensors[i].next;
      const SimTime end = sensor->schedule().at(number + 1);
      oldest_needed = std::min(oldest_needed, sensor->schedule().at(number));
      if (end > state_.time || end > first_end) continue;
      if (end < first_end) due.clear();
      first_end = end;
      due.push_back({v, i, sensor, number, sensor->schedule().at(number), end});
    }
  }
  if (due.empty()) {
    for (VehicleStatus& status : state_.vehicles) status.history.forget_before(oldest_needed);
  }
  return due;
}

/// Where a vehicle was; at the origin for one that is not there.
PoseTrack Simulation::track_of(std::size_t number, SimTime from, SimTime until) const {
  if (!status(number).present) return PoseTrack();
  if (!is_own(number)) {
    if (auto track = others_->track(number, from, until)) return *std::move(track);
  }
  return status(number).history.track(from, until);
}

/// Scans that have ended: taken in arrears, those that end together at the same time.
void Simulation::take_due_scans(SampleSink& sink) {
  for (auto due = due_intervals(); !due.empty(); due = due_intervals()) {
    const SimTime end = due.front().end;
    SimTime start = end;
    for (const DueInterval& d : due) start = std::min(start, d.start);
    std::vector<PoseTrack> tracks;
    tracks.reserve(vehicle_count());
    for (std::size_t v = 0; v < vehicle_count(); ++v) tracks.push_back(track_of(v, start, end));
    std::vector<std::optional<Sample>> samples(due.size());
    executor_->parallel_for(due.size(), 1, [&](std::size_t k, std::size_t) {
      const DueInterval& d = due[k];
      if (d.sensor->loses(d.index)) return;
      const std::vector<Body> bodies = bodies_for(d.vehicle, *d.sensor, tracks, d.start, end);
      samples[k] =
          d.sensor->measure({d.index, d.start, end, tracks[d.vehicle], bodies, *executor_});
    });
    for (std::size_t k = 0; k < due.size(); ++k) {
      VehicleStatus& status = state_.vehicles[due[k].vehicle];
      ++status.sensors[due[k].sensor_number].next;
      if (!samples[k]) continue;
      if (const auto* sample = std::get_if<ScanSample>(&*samples[k])) {
        ++status.summary.scans;
        status.summary.beams += sample->scan->beams;
        status.summary.points += sample->scan->points.size();
      }
      sink.on_sample(*samples[k]);
    }
  }
}

}  // namespace pointflight
