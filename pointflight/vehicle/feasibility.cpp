#include "pointflight/vehicle/feasibility.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "pointflight/core/constants.hpp"
#include "pointflight/core/math.hpp"
#include "pointflight/geometry/rotation.hpp"

namespace pointflight {
namespace {

constexpr double kStep = 0.01;         // s
constexpr double kInstants = 20000.0;  // at most
constexpr double kTolerance = 1.01;    // of a limit: rounding is no reason to speak
constexpr double kStartAway = 0.5;     // m
constexpr double kStartLeap = 1.0;     // m/s

}  // namespace

MotionDemand demand_of(const Trajectory& trajectory, const VehicleSettings& vehicle) {
  MotionDemand most;
  const double duration = trajectory.duration();
  const double instants = std::clamp(std::ceil(duration / kStep), 1.0, kInstants);
  for (double i = 0.0; i <= instants; ++i) {
    const double t = duration * i / instants;
    const PositionCommand c = trajectory.at(t);
    const auto note = [&](Peak& peak, double value) {
      if (value > peak.value) peak = {value, t, c.p_world};
    };
    const Quaterniond level = quaternion_from_rpy(0.0, 0.0, c.yaw);
    const Vector3d drag = level * vehicle.drag_in_still_air(level.conjugate() * c.v_world);
    const Vector3d a = c.a_world - drag;
    const double sideways = std::hypot(a.x(), a.y());
    note(most.speed, c.v_world.norm());
    note(most.acceleration, sideways);
    note(most.climb_acceleration, a.z());
    note(most.tilt, math::atan2(sideways, a.z() + kGravity));
    const Vector3d force = a + Vector3d(0, 0, kGravity);
    const Vector3d up = force / std::max(force.norm(), 1e-9);
    // b3' = (jerk - (b3 . jerk) b3) / |f|
    const Vector3d turning = c.jerk_world - up.dot(c.jerk_world) * up;
    note(most.tilt_rate, turning.norm() / std::max(force.norm(), 1e-3));
    note(most.yaw_rate, std::abs(c.yaw_rate));
    const Vector3d push = vehicle.mass * force;
    const double climb = c.v_world.dot(up);
    const double share = vehicle.rotor.thrust_share(climb, vehicle.rotor.speed_max);
    note(most.thrust, push.norm() / std::max(share, 0.01));
  }
  return most;
}

std::optional<std::string> beyond_limits(const Trajectory& trajectory,
                                         const VehicleSettings& vehicle,
                                         const RigidBodyState* from) {
  const MotionDemand most = demand_of(trajectory, vehicle);
  const ControllerSettings& c = vehicle.controller;
  std::vector<std::string> beyond;
  const auto compare =
      [&](const char* what, const Peak& peak, double unit, double limit, const char* name) {
        const double needed = peak.value / unit;
        if (needed <= kTolerance * limit) return;
        const Vector3d& p = peak.position_world;
        beyond.push_back(
            fmt::format("{} of {:.3g}{} (limit {:.3g}) after {:.1f} s at {:.1f}, {:.1f}, {:.1f}",
                        what,
                        needed,
                        name,
                        limit,
                        peak.time,
                        p.x(),
                        p.y(),
                        p.z()));
      };
  compare("a speed", most.speed, 1.0, c.speed_max, " m/s");
  if (c.tilt_max_deg < 90.0) {
    compare("a tilt", most.tilt, kDegree, c.tilt_max_deg, " degrees");
  }
  compare("a horizontal acceleration", most.acceleration, 1.0, c.acceleration_max, " m/s^2");
  compare("an acceleration up", most.climb_acceleration, 1.0, c.climb_acceleration_max, " m/s^2");
  compare("a turn of the thrust's axis", most.tilt_rate, 1.0, c.body_rate_max, " rad/s");
  compare("a yaw rate", most.yaw_rate, 1.0, c.body_rate_max, " rad/s");
  const double weight = vehicle.mass * kGravity;
  compare("a thrust", most.thrust, 1.0, vehicle.thrust_to_weight() * weight, " N");
  if (from != nullptr) {
    const PositionCommand first = trajectory.at(0.0);
    const double away = (first.p_world - from->p_world).norm();
    if (away > kStartAway) beyond.push_back(fmt::format("a start {:.1f} m away", away));
    const double leap = (first.v_world - from->v_world).norm();
    if (leap > kStartLeap) beyond.push_back(fmt::format("a leap in speed of {:.1f} m/s", leap));
  }
  if (beyond.empty()) return std::nullopt;
  return fmt::format("the trajectory asks for {}; it will be flown beside its path",
                     fmt::join(beyond, ", "));
}

}  // namespace pointflight
