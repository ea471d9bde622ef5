#include "pointflight/share/remote_track.hpp"

#include <algorithm>
#include <cmath>

#include "pointflight/core/constants.hpp"
#include "pointflight/geometry/rotation.hpp"

namespace pointflight {
namespace {

constexpr Duration kKept = std::chrono::seconds(3);
constexpr Duration kTrackStep = std::chrono::milliseconds(5);

}  // namespace

RigidBodyState moved_on(const RigidBodyState& state, double seconds) {
  RigidBodyState moved = state;
  moved.p_world += seconds * state.v_world;
  moved.q_world_body =
      (state.q_world_body * quaternion_from_rotation_vector(seconds * state.omega_body))
          .normalized();
  return moved;
}

RigidBodyState between(const RigidBodyState& a,
                       const RigidBodyState& b,
                       double seconds,
                       double share) {
  const double s = share;
  const double s2 = s * s;
  const double s3 = s2 * s;
  RigidBodyState state;
  state.p_world = (2.0 * s3 - 3.0 * s2 + 1.0) * a.p_world +
                  (s3 - 2.0 * s2 + s) * seconds * a.v_world + (-2.0 * s3 + 3.0 * s2) * b.p_world +
                  (s3 - s2) * seconds * b.v_world;
  state.q_world_body = interpolate(a.q_world_body, b.q_world_body, s);
  state.v_world = (1.0 - s) * a.v_world + s * b.v_world;
  state.omega_body = (1.0 - s) * a.omega_body + s * b.omega_body;
  return state;
}

double extrapolation_bound(const VehicleSettings& vehicle, double radius, double seconds) {
  const double speed = vehicle.controller.speed_max;
  double drag = 0.0;
  for (const Vector3d& axis :
       {Vector3d(Vector3d::UnitX()), Vector3d(Vector3d::UnitY()), Vector3d(Vector3d::UnitZ())}) {
    drag = std::max(drag, vehicle.drag_in_still_air(speed * axis).norm());
  }
  const double acceleration = (vehicle.thrust_to_weight() + 1.0) * kGravity + drag;
  const double thrust =
      vehicle.rotor.thrust_coefficient * vehicle.rotor.speed_max * vehicle.rotor.speed_max;
  const double rate = vehicle.controller.body_rate_max;
  double torque = 0.0;  // all rotors of one side at full speed, the others off
  for (const RotorPlacement& rotor : vehicle.rotors) {
    torque += 0.5 * thrust * rotor.position.head<2>().norm();
    torque += vehicle.rotor.inertia * vehicle.rotor.speed_max * rate;  // gyroscopic
  }
  const double least = vehicle.inertia_diagonal.minCoeff();
  const double greatest = vehicle.inertia_diagonal.maxCoeff();
  const double turn = torque / least + (greatest - least) / least * rate * rate;
  return 0.5 * seconds * seconds * (acceleration + turn * radius);
}

void RemoteTrack::add(SimTime time, const RigidBodyState& state) {
  auto place = states_.end();
  while (place != states_.begin() && std::prev(place)->time >= time) --place;
  if (place != states_.end() && place->time == time) return;  // said twice
  states_.insert(place, {time, state});
  while (states_.size() > 2 && states_[1].time < states_.back().time - kKept) states_.pop_front();
}

void RemoteTrack::add_past(SimTime time, const RigidBodyState& state) {
  if (states_.empty() || states_.back().time < time) states_.push_back({time, state});
}

std::optional<RigidBodyState> RemoteTrack::at(SimTime time, Duration most) const {
  if (states_.empty() || time < states_.front().time) return std::nullopt;
  const auto later = [](SimTime t, const Timed& timed) { return t < timed.time; };
  const auto next = std::upper_bound(states_.begin(), states_.end(), time, later);
  const Timed& before = *std::prev(next);
  if (next == states_.end()) {
    return moved_on(before.state, to_seconds(std::min(time - before.time, most)));
  }
  const Duration gap = next->time - before.time;
  if (gap > most) return moved_on(before.state, to_seconds(std::min(time - before.time, most)));
  const double seconds = to_seconds(gap);
  return between(before.state, next->state, seconds, to_seconds(time - before.time) / seconds);
}

std::optional<PoseTrack> RemoteTrack::track(SimTime from, SimTime until, Duration most) const {
  std::vector<TimedPose> poses;
  for (SimTime time = from; time < until + kTrackStep; time += kTrackStep) {
    const SimTime instant = std::min(time, until);
    if (!poses.empty() && poses.back().time >= instant) break;
    if (const auto state = at(instant, most)) poses.push_back({instant, state->T_world_body()});
  }
  if (poses.empty()) return std::nullopt;
  return PoseTrack(std::move(poses));
}

}  // namespace pointflight
