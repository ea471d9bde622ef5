#pragma once

#include <memory>
#include <vector>

#include "pointflight/vehicle/airframe.hpp"
#include "pointflight/vehicle/state.hpp"

namespace pointflight {

/// Where to be and how to move there; derivatives are feed-forward and may stay zero.
struct PositionCommand {
  Vector3d p_world = Vector3d::Zero();
  Vector3d v_world = Vector3d::Zero();
  Vector3d a_world = Vector3d::Zero();
  Vector3d jerk_world = Vector3d::Zero();
  double yaw = 0.0;       ///< rad, from world x towards y
  double yaw_rate = 0.0;  ///< rad/s
};

/// Turns commands into rotor speeds. It sees the true state (later: an estimate).
///
/// To add one: a file in vehicle/controllers/, one line in `make_controller`, a step-response test,
/// and its keys with defaults in ControllerSettings.
class Controller {
 public:
  virtual ~Controller() = default;

  /// Rotor speed commands (rad/s) for a period of `dt` seconds.
  virtual std::vector<double> update(const RigidBodyState& state,
                                     const PositionCommand& command,
                                     double dt) = 0;

  /// Forgets integrals: a new flight.
  virtual void reset() = 0;
};

/// The paper's cascaded PID; the only one so far.
std::unique_ptr<Controller> make_controller(const VehicleSettings& settings);

}  // namespace pointflight
