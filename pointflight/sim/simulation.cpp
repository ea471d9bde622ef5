#include "pointflight/sim/simulation.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "pointflight/core/constants.hpp"
#include "pointflight/core/input_error.hpp"
#include "pointflight/core/resources.hpp"
#include "pointflight/geometry/rotation.hpp"

namespace pointflight {
namespace {

constexpr double kSettleTime = 1.0;      // s after the mission's last instant
constexpr double kHoverDuration = 10.0;  // s, without a mission
constexpr double kGoalTolerance = 0.5;   // m

}  // namespace

/// A LiDAR on the vehicle with its renderer and the number of its next scan.
struct Simulation::MountedLidar {
  Lidar lidar;
  std::unique_ptr<Renderer> renderer;
  Pose T_body_sensor;
  Schedule schedule;
  bool snapshot;
  bool noise;
  std::int64_t next = 0;
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
    case RunEnd::kInterrupted:
      return "interrupted";
  }
  return "";
}

Simulation::Simulation(const Scenario& scenario,
                       std::shared_ptr<const SurfelMap> map,
                       const Executor& executor)
    : scenario_(scenario),
      map_(std::move(map)),
      executor_(executor),
      dynamics_(
          scenario.at("vehicle.model",
                      [&] { return load_vehicle(scenario.vehicle.model, scenario.folder()); })),
      controller_(make_controller(dynamics_.settings())),
      imu_(dynamics_.settings().imu, static_cast<std::uint64_t>(scenario.seed), 0),
      mission_(scenario.vehicle.start, scenario.vehicle.start_yaw_deg * kDegree, scenario.mission),
      step_(from_seconds(scenario.physics_step)),
      state_schedule_(scenario.output.trajectory_rate),
      imu_schedule_(dynamics_.settings().imu.rate) {
  for (const LidarMount& mount : scenario_.lidars) {
    const Vector3d rpy = mount.rotation_rpy_deg * kDegree;
    const auto number = static_cast<std::uint32_t>(lidars_.size());
    Lidar lidar = scenario_.at(fmt::format("lidars[{}].model", number), [&] {
      return Lidar(load_lidar(mount.model, scenario_.folder()), number);
    });
    const double rate = lidar.settings().rate;
    lidars_.push_back({std::move(lidar),
                       make_renderer(mount.renderer, Scene{map_}),
                       {quaternion_from_rpy(rpy.x(), rpy.y(), rpy.z()), mount.position},
                       Schedule(rate),
                       mount.snapshot,
                       mount.noise});
  }
  state_ = dynamics_.hover_at(scenario_.vehicle.start, scenario_.vehicle.start_yaw_deg * kDegree);
  rotor_commands_.assign(state_.rotors.size(), dynamics_.settings().hover_speed());
  const double natural =
      scenario_.mission.waypoints.empty() ? kHoverDuration : mission_.duration() + kSettleTime;
  end_time_ = SimTime(from_seconds(scenario_.duration > 0.0 ? scenario_.duration : natural));
  check_start();
}

Simulation::~Simulation() = default;

void Simulation::check_start() {
  const auto here =
      clearance(*map_, state_.body.p_world, dynamics_.settings().radius, kClearanceReach);
  if (here && here->distance < 0.0) {
    const Vector3d& p = scenario_.vehicle.start;
    throw InputError(fmt::format(
        "{}: vehicle.start: ({:.2f}, {:.2f}, {:.2f}) is {:.2f} m inside the map for a vehicle of "
        "radius {:.2f} m; move it, or let `pointflight scenario new` find a free place",
        scenario_.place("vehicle.start"),
        p.x(),
        p.y(),
        p.z(),
        -here->distance,
        dynamics_.settings().radius));
  }
}

bool Simulation::step(SampleSink& sink) {
  if (summary_.end != RunEnd::kRunning) return false;
  command_ = mission_.at(time_);
  rotor_commands_ = controller_->update(state_.body, command_, to_seconds(step_));
  history_.record(time_, state_.body.T_world_body());
  sense_clearance(sink);
  const bool stops = colliding_ && scenario_.vehicle.on_collision == "stop";
  sample_until(stops ? time_ + Duration{1} : time_ + step_, sink);
  take_due_scans(time_, sink);
  if (stops) {
    finish(RunEnd::kCollision);
    return false;
  }
  if (time_ >= end_time_) {
    // the last scan ends with the run; its late channels need poses of one step more
    history_.record(time_ + step_, state_at(time_ + step_).body.T_world_body());
    take_due_scans(time_ + step_, sink);
    const bool arrived = (state_.body.p_world - mission_.goal()).norm() < kGoalTolerance &&
                         to_seconds(time_) >= mission_.duration();
    finish(scenario_.mission.waypoints.empty() || arrived ? RunEnd::kCompleted
                                                          : RunEnd::kMissionUnfinished);
    return false;
  }

  const Vector3d before = state_.body.p_world;
  dynamics_.step(state_, rotor_commands_, to_seconds(step_));
  time_ += step_;
  if (!state_.body.p_world.allFinite()) {
    throw InputError(fmt::format(
        "{}: the dynamics diverged at {:.3f} s; give a smaller physics_step or softer loops",
        scenario_.place("physics_step"),
        to_seconds(time_)));
  }
  ++steps_;
  summary_.time = time_;
  summary_.distance_flown += (state_.body.p_world - before).norm();
  summary_.speed_max = std::max(summary_.speed_max, state_.body.v_world.norm());
  const double error = (state_.body.p_world - mission_.at(time_).p_world).norm();
  squared_error_sum_ += error * error;
  summary_.tracking_error_max = std::max(summary_.tracking_error_max, error);
  summary_.tracking_error_rms = std::sqrt(squared_error_sum_ / static_cast<double>(steps_));
  return true;
}

void Simulation::interrupt() {
  finish(RunEnd::kInterrupted);
}

void Simulation::finish(RunEnd end) {
  summary_.end = end;
  summary_.time = time_;
}

/// True if the sphere met the map between the last two steps: fast, small vehicles, thin walls.
bool Simulation::passed_through() const {
  if (!previous_p_world_ || !clearance_) return false;
  const double moved = (state_.body.p_world - *previous_p_world_).norm();
  if (clearance_->distance >= moved) return false;
  const double radius = dynamics_.settings().radius;
  return clearance_along(*map_, *previous_p_world_, state_.body.p_world, radius, moved) < 0.0;
}

void Simulation::sense_clearance(SampleSink& sink) {
  const double radius = dynamics_.settings().radius;
  clearance_ = clearance(*map_, state_.body.p_world, radius, kClearanceReach);
  if (clearance_ &&
      (!summary_.closest_approach || clearance_->distance < *summary_.closest_approach)) {
    summary_.closest_approach = clearance_->distance;
    summary_.closest_place_world = clearance_->place_world;
  }
  const bool inside = (clearance_ && clearance_->distance < 0.0) || passed_through();
  previous_p_world_ = state_.body.p_world;
  if (inside != colliding_) {
    colliding_ = inside;
    summary_.collisions += inside ? 1 : 0;
    CollisionEvent event;
    event.time = time_;
    event.entered = inside;
    event.vehicle_world = state_.body.p_world;
    if (clearance_) event.place_world = clearance_->place_world;
    event.penetration = inside ? std::max(0.0, -clearance_->distance) : 0.0;
    sink.on_collision(event);
  }
}

/// The state within the present step, by the same integrator.
VehicleState Simulation::state_at(SimTime time) const {
  VehicleState state = state_;
  if (time > time_) dynamics_.step(state, rotor_commands_, to_seconds(time - time_));
  return state;
}

/// Samples due in [time_, end), in the order (time, kind).
void Simulation::sample_until(SimTime end, SampleSink& sink) {
  for (;;) {
    const SimTime state_time = state_schedule_.at(next_state_);
    const SimTime imu_time = imu_schedule_.at(next_imu_);
    const SimTime next = std::min(state_time, imu_time);
    if (next >= end || next > end_time_) return;
    const VehicleState state = state_at(next);
    if (state_time == next) {
      StateSample sample{next, state, mission_.at(next), std::nullopt};
      if (clearance_) sample.clearance = clearance_->distance;
      sink.on_state(sample);
      ++next_state_;
      ++summary_.states;
    }
    if (imu_time == next) {
      sink.on_imu(
          imu_.sample(next_imu_, next, state.body, dynamics_.acceleration(state, rotor_commands_)));
      ++next_imu_;
      ++summary_.imu_samples;
    }
  }
}

/// Scans whose last beam lies before `known`, the newest record: rendered in arrears.
void Simulation::take_due_scans(SimTime known, SampleSink& sink) {
  for (;;) {
    // in the order of their ends; several may be due where a sensor is faster than the physics
    MountedLidar* next = nullptr;
    SimTime next_end = SimTime::max();
    SimTime oldest_needed = time_;
    for (MountedLidar& mounted : lidars_) {
      const SimTime end = mounted.schedule.at(mounted.next + 1);
      oldest_needed = std::min(oldest_needed, mounted.schedule.at(mounted.next));
      // a step later than the scan's end: channels of the last cycle fire up to 0.1 ms after it
      if (end + step_ > known || end >= next_end) continue;
      next = &mounted;
      next_end = end;
    }
    if (next == nullptr) {
      history_.forget_before(oldest_needed);
      return;
    }
    take_scan(*next, sink);
  }
}

void Simulation::take_scan(MountedLidar& mounted, SampleSink& sink) {
  const PoseAt pose_at = [&](SimTime t) { return history_.at(t) * mounted.T_body_sensor; };
  const ScanRequest request{static_cast<std::uint64_t>(mounted.next),
                            mounted.schedule.at(mounted.next),
                            mounted.snapshot,
                            mounted.noise,
                            static_cast<std::uint64_t>(scenario_.seed),
                            {}};
  const Scan scan = mounted.lidar.take(request, pose_at, *mounted.renderer, executor_);
  ++mounted.next;
  ++summary_.scans;
  summary_.beams += scan.beams;
  summary_.points += scan.points.size();
  sink.on_scan(scan, pose_at);
}

}  // namespace pointflight
