#pragma once

#include <optional>
#include <string>

#include "pointflight/vehicle/airframe.hpp"
#include "pointflight/vehicle/state.hpp"
#include "pointflight/vehicle/trajectory.hpp"

namespace pointflight {

/// The most that a trajectory asks of a vehicle in still air.
struct MotionDemand {
  double speed = 0.0;               ///< m/s
  double acceleration = 0.0;        ///< Horizontal, drag included, m/s^2.
  double climb_acceleration = 0.0;  ///< Up, m/s^2.
  double tilt = 0.0;                ///< rad
  double thrust = 0.0;              ///< N
};

/// Looks at 20,000 instants at most, a hundredth of a second apart where the trajectory is short.
MotionDemand demand_of(const Trajectory& trajectory, const VehicleSettings& vehicle);

/// In words, what of a trajectory is beyond a vehicle: limits of its controller, thrust, and a
/// start that is not where and as fast as it is (`from`; null: anywhere). Nothing where it can be
/// flown.
std::optional<std::string> beyond_limits(const Trajectory& trajectory,
                                         const VehicleSettings& vehicle,
                                         const RigidBodyState* from);

}  // namespace pointflight
