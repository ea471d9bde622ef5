#pragma once

#include <optional>
#include <string>

#include "pointflight/vehicle/airframe.hpp"
#include "pointflight/vehicle/state.hpp"
#include "pointflight/vehicle/trajectory.hpp"

namespace pointflight {

/// The most of something on a trajectory, and where that is.
struct Peak {
  double value = 0.0;                          ///< In its own unit.
  double time = 0.0;                           ///< Since the trajectory's start, s.
  Vector3d position_world = Vector3d::Zero();  ///< m
};

/// The most that a trajectory asks of a vehicle in still air.
struct MotionDemand {
  Peak speed;               ///< m/s
  Peak acceleration;        ///< Horizontal, drag included, m/s^2.
  Peak climb_acceleration;  ///< Up, m/s^2.
  Peak tilt;                ///< rad
  Peak tilt_rate;           ///< Of roll and pitch together, by jerk (Mellinger, Kumar 2011), rad/s.
  Peak yaw_rate;            ///< rad/s
  Peak thrust;              ///< N
};

/// Looks at 20,000 instants at most, a hundredth of a second apart if the trajectory is short.
MotionDemand demand_of(const Trajectory& trajectory, const VehicleSettings& vehicle);

/// In words, what of a trajectory is beyond a vehicle, and where: limits of its controller, thrust,
/// a start that is not where and as fast as it is (`from`; null: anywhere). Nothing if it can be
/// flown.
std::optional<std::string> beyond_limits(const Trajectory& trajectory,
                                         const VehicleSettings& vehicle,
                                         const RigidBodyState* from);

}  // namespace pointflight
