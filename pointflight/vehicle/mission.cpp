#include "pointflight/vehicle/mission.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "pointflight/core/constants.hpp"
#include "pointflight/core/math.hpp"
#include "pointflight/geometry/rotation.hpp"

namespace pointflight {
namespace {

/// Phases that reach `speed` from rest: jerk up, steady, jerk down.
struct Ramp {
  double t_jerk;
  double t_steady;
  [[nodiscard]] double duration() const { return 2.0 * t_jerk + t_steady; }
};

Ramp ramp_to(double speed, const MotionLimits& limits) {
  const double t_full = limits.acceleration / limits.jerk;
  if (speed < limits.acceleration * t_full) return {std::sqrt(speed / limits.jerk), 0.0};
  return {t_full, speed / limits.acceleration - t_full};
}

}  // namespace

SmoothMove::SmoothMove(double distance, const MotionLimits& limits)
    : distance_(distance), jerk_(limits.jerk) {
  assert(distance >= 0.0 && std::isfinite(distance));
  assert(limits.speed > 0.0 && limits.acceleration > 0.0 && limits.jerk > 0.0);
  if (distance <= 0.0) return;
  // a ramp up and one down at peak speed v cover v * ramp duration; shrink v until they fit
  double speed = limits.speed;
  if (speed * ramp_to(speed, limits).duration() > distance) {
    double low = 0.0;
    for (int i = 0; i < 80; ++i) {
      const double middle = 0.5 * (low + speed);
      (middle * ramp_to(middle, limits).duration() > distance ? speed : low) = middle;
    }
    speed = low;
  }
  const Ramp ramp = ramp_to(speed, limits);
  t_jerk_ = ramp.t_jerk;
  t_steady_ = ramp.t_steady;
  t_cruise_ = speed > 0.0 ? std::max(0.0, distance / speed - ramp.duration()) : 0.0;
}

SmoothMove::Sample SmoothMove::at(double t) const {
  if (t <= 0.0 || distance_ <= 0.0) return {0.0, 0.0, 0.0, 0.0};
  if (t >= duration()) return {distance_, 0.0, 0.0, 0.0};
  const double phases[7] = {t_jerk_, t_steady_, t_jerk_, t_cruise_, t_jerk_, t_steady_, t_jerk_};
  const double jerks[7] = {jerk_, 0.0, -jerk_, 0.0, -jerk_, 0.0, jerk_};
  Sample s{0.0, 0.0, 0.0, 0.0};
  for (int i = 0; i < 7; ++i) {
    const double h = std::min(t, phases[i]);
    const double j = jerks[i];
    s.position += h * (s.speed + h * (s.acceleration / 2.0 + h * j / 6.0));
    s.speed += h * (s.acceleration + h * j / 2.0);
    s.acceleration += h * j;
    s.jerk = j;
    t -= h;
    if (t <= 0.0) break;
  }
  return s;
}

Mission::Mission(const Vector3d& start, double yaw, const MissionSettings& settings)
    : goal_(start), yaw_(yaw) {
  const double rate = settings.yaw_rate_deg * kDegree;
  const MotionLimits turning{rate, 2.0 * rate, 8.0 * rate};
  for (const Vector3d& waypoint : settings.waypoints) {
    const Vector3d way = waypoint - goal_;
    const double distance = way.norm();
    Leg leg;
    leg.start = duration_;
    leg.from = goal_;
    leg.direction = Vector3d::Zero();
    leg.yaw_from = yaw_;
    leg.yaw_sign = 1.0;
    if (distance < 1e-9) {  // it is there, and rests there
      legs_.push_back(leg);
      duration_ += settings.hold;
      continue;
    }
    leg.direction = way / distance;
    const bool steep = std::hypot(way.x(), way.y()) < 0.1 * distance;
    if (settings.yaw == YawMode::kAlongPath && !steep) {
      const double turn = wrap_angle(math::atan2(way.y(), way.x()) - yaw_);
      leg.yaw_sign = turn < 0.0 ? -1.0 : 1.0;
      leg.turn = SmoothMove(std::abs(turn), turning);
      yaw_ = wrap_angle(yaw_ + turn);
    }
    leg.travel = SmoothMove(distance, settings.motion);
    legs_.push_back(leg);
    duration_ += leg.turn.duration() + leg.travel.duration() + settings.hold;
    length_ += distance;
    goal_ = waypoint;
  }
  if (!settings.final_yaw) return;
  Leg last;  // turns on the spot
  last.start = duration_;
  last.from = goal_;
  last.direction = Vector3d::Zero();
  last.yaw_from = yaw_;
  const double turn = wrap_angle(*settings.final_yaw - yaw_);
  last.yaw_sign = turn < 0.0 ? -1.0 : 1.0;
  last.turn = SmoothMove(std::abs(turn), turning);
  last.travel = SmoothMove(0.0, settings.motion);
  legs_.push_back(last);
  duration_ += last.turn.duration();
  yaw_ = wrap_angle(yaw_ + turn);
}

PositionCommand Mission::at(double t) const {
  PositionCommand command;
  command.p_world = goal_;
  command.yaw = yaw_;
  const auto after = std::upper_bound(
      legs_.begin(), legs_.end(), t, [](double at, const Leg& leg) { return at < leg.start; });
  if (after == legs_.begin()) return command;
  const Leg& leg = *(after - 1);
  const SmoothMove::Sample turn = leg.turn.at(t - leg.start);
  const SmoothMove::Sample s = leg.travel.at(t - leg.start - leg.turn.duration());
  command.p_world = leg.from + s.position * leg.direction;
  command.v_world = s.speed * leg.direction;
  command.a_world = s.acceleration * leg.direction;
  command.jerk_world = s.jerk * leg.direction;
  command.yaw = leg.yaw_from + leg.yaw_sign * turn.position;
  command.yaw_rate = leg.yaw_sign * turn.speed;
  return command;
}

}  // namespace pointflight
