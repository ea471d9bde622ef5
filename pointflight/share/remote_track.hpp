#pragma once

#include <deque>
#include <optional>

#include "pointflight/geometry/motion.hpp"
#include "pointflight/vehicle/airframe.hpp"
#include "pointflight/vehicle/state.hpp"

namespace pointflight {

/// A state moved on at its present velocities, SE(3) as R3 x SO(3): the centre of mass straight
/// ahead at `v_world`, the attitude by the exponential of `omega_body` (Sola et al. 2018, "A micro
/// Lie theory", example 4). A screw by the whole twist would bend the way of a body that turns as
/// it flies, which a multirotor's way does not do.
RigidBodyState moved_on(const RigidBodyState& state, double seconds);

/// Between two states: the centre of mass along the cubic that has their positions and velocities
/// (Hermite), the attitude by the shortest turn, velocities linearly. `share` from 0 to 1.
RigidBodyState between(const RigidBodyState& a,
                       const RigidBodyState& b,
                       double seconds,
                       double share);

/// No point of a vehicle's body is farther from where `moved_on` puts it, m. Over `seconds` the
/// centre of mass strays by a t^2 / 2 at most, a = what all rotors give at full speed over the mass
/// + gravity + what the air takes at its greatest speed; a point at `radius` by alpha t^2 / 2 *
/// radius more, alpha = (the greatest torque of the rotors, their gyroscopic torque at the greatest
/// body rate) over the least moment of inertia + what its own turning does to it (Euler's
/// equations). Collisions, ground effect and gusts are not in it.
double extrapolation_bound(const VehicleSettings& vehicle, double radius, double seconds);

/// States of a vehicle of another process as they come in, some late, some never.
class RemoteTrack {
 public:
  /// Inserts a state in order of time; states too old to matter are dropped.
  void add(SimTime time, const RigidBodyState& state);
  /// The same for what is past altogether: nothing is forgotten, times ascend or it is left out.
  void add_past(SimTime time, const RigidBodyState& state);
  /// Nothing of before holds.
  void clear() { states_.clear(); }
  /// None came.
  [[nodiscard]] bool empty() const { return states_.empty(); }
  /// Of the newest; not of an empty one.
  [[nodiscard]] SimTime newest() const { return states_.back().time; }
  /// Of the oldest; not of an empty one.
  [[nodiscard]] SimTime oldest() const { return states_.front().time; }
  /// The newest.
  [[nodiscard]] const RigidBodyState& last() const { return states_.back().state; }

  /// The state at an instant: between two that came, or the last one moved on for at most `most`.
  /// Nothing before the first.
  [[nodiscard]] std::optional<RigidBodyState> at(SimTime time, Duration most) const;

  /// Where it was in [from, until], in steps of 5 ms: what is between them is below 0.1 mm off at
  /// 30 m/s^2. Nothing if nothing is known of it.
  [[nodiscard]] std::optional<PoseTrack> track(SimTime from, SimTime until, Duration most) const;

 private:
  struct Timed {
    SimTime time;
    RigidBodyState state;
  };
  std::deque<Timed> states_;
};

}  // namespace pointflight
