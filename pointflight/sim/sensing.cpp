#include "pointflight/sim/sensing.hpp"

#include <algorithm>
#include <map>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

namespace pointflight {
namespace {

constexpr double kBeamOrigin = 1.0;  // m: beams start no farther from their sensor

/// A measurement whose interval has ended.
struct DueInterval {
  std::size_t vehicle = 0;
  std::size_t sensor_number = 0;
  const IntervalSensor* sensor = nullptr;
  SensorCosts::Accounts* accounts = nullptr;  ///< Of the sensor.
  std::int64_t index = 0;
  SimTime start, end;
};

/// What has ended by `now`: of all, those that ended first, at the same instant. If nothing has,
/// vehicles forget where they were before what is still to be measured.
std::vector<DueInterval> due_intervals(const Fleet& fleet,
                                       std::span<VehicleStatus> statuses,
                                       SensorCosts& costs,
                                       SimTime now) {
  std::vector<DueInterval> due;
  SimTime first_end = SimTime::max();
  SimTime oldest_needed = now;
  for (const std::size_t v : fleet.flying_here()) {
    const auto sensors = fleet.vehicle(v).sensors();
    for (std::size_t i = 0; i < sensors.size(); ++i) {
      const IntervalSensor* sensor = sensors[i].interval;
      if (sensor == nullptr) continue;
      const std::int64_t number = statuses[v].sensors[i].next;
      const SimTime start = sensor->schedule().at(number);
      const SimTime end = sensor->schedule().at(number + 1);
      oldest_needed = std::min(oldest_needed, start);
      if (end > now || end > first_end) continue;
      if (end < first_end) due.clear();
      first_end = end;
      due.push_back({v, i, sensor, &costs.of(v, i), number, start, end});
    }
  }
  if (due.empty()) {
    for (VehicleStatus& status : statuses) status.history.forget_before(oldest_needed);
  }
  return due;
}

/// What a sensor can hit: everybody else, and the obstacles that are near enough. `tracks` of all
/// vehicles.
std::vector<Body> bodies_for(const DueInterval& due,
                             const Fleet& fleet,
                             const Obstacles& obstacles,
                             std::span<const VehicleStatus> statuses,
                             std::span<const PoseTrack> tracks) {
  const PoseTrack& own = tracks[due.vehicle];
  const SimTime middle = due.start + (due.end - due.start) / 2;
  const double moved = own.speed_max(due.start, due.end) * to_seconds(due.end - middle);
  std::vector<Body> bodies = obstacles.near(
      own.at(middle).translation, due.sensor->reach() + moved + kBeamOrigin, due.start, due.end);
  for (std::size_t i = 0; i < fleet.size(); ++i) {
    const bool is_own = i == due.vehicle;
    if ((is_own && !due.sensor->sees_own_vehicle()) || !statuses[i].present) continue;
    Body body = fleet.vehicle(i).body();
    body.speed_max = tracks[i].speed_max(due.start, due.end);
    body.motion = tracks[i];
    body.from = statuses[i].present_since;
    bodies.push_back(std::move(body));
  }
  return bodies;
}

void count(const Sample& sample, VehicleSummary& summary) {
  const auto* scanned = std::get_if<ScanSample>(&sample);
  if (scanned == nullptr) return;
  ++summary.scans;
  summary.beams += scanned->scan->beams;
  summary.points += scanned->scan->points.size();
}

/// Measurements under way together: they aim, each renderer is given the jobs of all, `take`
/// finishes them.
class Together {
 public:
  Together(const Fleet& fleet,
           const Obstacles& obstacles,
           std::span<const VehicleStatus> statuses,
           std::span<const PoseTrack> tracks,
           std::span<const DueInterval> due,
           const Executor& executor)
      : due_(due), executor_(executor), bodies_(due.size()), measurements_(due.size()) {
    executor.parallel_for(due.size(), 1, [&](std::size_t k, std::size_t) {
      const DueInterval& d = due[k];
      const ChargeTo charge(&d.accounts->rest);
      if (d.sensor->loses(d.index)) return;
      bodies_[k] = bodies_for(d, fleet, obstacles, statuses, tracks);
      measurements_[k] =
          d.sensor->begin({d.index, d.start, d.end, tracks[d.vehicle], bodies_[k], executor});
    });
    render();
  }

  [[nodiscard]] std::span<const DueInterval> due() const { return due_; }

  /// By number of `due`; nothing of those that were lost.
  std::vector<std::optional<Sample>> take() {
    for (const auto& rendering : renderings_) rendering->collect();
    std::vector<std::optional<Sample>> samples(due_.size());
    executor_.parallel_for(due_.size(), 1, [&](std::size_t k, std::size_t) {
      const ChargeTo charge(&due_[k].accounts->rest);
      if (measurements_[k]) samples[k] = measurements_[k]->finish(executor_);
      measurements_[k].reset();
    });
    return samples;
  }

 private:
  /// What all measurements want to see.
  void render() {
    for (std::size_t k = 0; k < due_.size(); ++k) {
      if (!measurements_[k]) continue;
      auto job = measurements_[k]->job();
      if (!job) continue;
      job->account = &due_[k].accounts->rendering;
      jobs_[due_[k].sensor->renderer()].push_back(*job);
    }
    for (const auto& [renderer, its_jobs] : jobs_) {
      renderings_.push_back(renderer->submit(its_jobs, executor_));
    }
  }

  std::span<const DueInterval> due_;
  const Executor& executor_;
  std::vector<std::vector<Body>> bodies_;
  std::vector<std::unique_ptr<IntervalMeasurement>> measurements_;
  std::map<const Renderer*, std::vector<RenderJob>> jobs_;
  std::vector<std::unique_ptr<Rendering>>
      renderings_;  ///< The first to go: they write to the rest.
};

/// As many as renderers want together; 0: none wants more than there are threads.
std::size_t wanted_at_once(std::span<const DueInterval> due) {
  std::size_t most = 0;
  for (const DueInterval& d : due) {
    const Renderer* renderer = d.sensor->renderer();
    if (renderer != nullptr) most = std::max(most, renderer->jobs_at_once());
  }
  return most;
}

}  // namespace

void sense_intervals(const Fleet& fleet,
                     const Obstacles& obstacles,
                     SimTime now,
                     std::span<VehicleStatus> statuses,
                     SensorCosts& costs,
                     SampleSink& sink,
                     const Executor& executor) {
  const auto next_due = [&] { return due_intervals(fleet, statuses, costs, now); };
  for (auto due = next_due(); !due.empty(); due = next_due()) {
    const SimTime end = due.front().end;
    SimTime start = end;
    for (const DueInterval& d : due) start = std::min(start, d.start);
    std::vector<PoseTrack> tracks;
    tracks.reserve(fleet.size());
    for (std::size_t v = 0; v < fleet.size(); ++v) {
      tracks.push_back(fleet.track(statuses[v], v, start, end));
    }
    const auto finish = [&](Together& together) {
      const auto samples = together.take();
      for (std::size_t k = 0; k < samples.size(); ++k) {
        const DueInterval& done = together.due()[k];
        VehicleStatus& status = statuses[done.vehicle];
        ++status.sensors[done.sensor_number].next;
        if (!samples[k]) continue;
        count(*samples[k], status.summary);
        sink.on_sample(*samples[k]);
      }
    };
    // as many under way as there are threads: their beams and hits take memory; a device has more,
    // and renders some while others are finished
    const std::size_t wanted = wanted_at_once(due);
    const std::size_t at_once = std::max(wanted, static_cast<std::size_t>(executor.threads()));
    std::unique_ptr<Together> before;
    for (std::size_t from = 0; from < due.size(); from += at_once) {
      const std::span part = std::span(due).subspan(from, std::min(at_once, due.size() - from));
      auto together =
          std::make_unique<Together>(fleet, obstacles, statuses, tracks, part, executor);
      if (before) finish(*before);
      before = std::move(together);
      if (wanted > 0) continue;
      finish(*before);
      before.reset();
    }
    if (before) finish(*before);
  }
}

}  // namespace pointflight
