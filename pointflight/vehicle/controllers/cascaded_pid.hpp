#pragma once

#include "pointflight/vehicle/controllers/loops.hpp"

namespace pointflight {

/// Cascaded PID (the paper, section IV.C): an outer position loop and an inner attitude loop, each
/// of second order with a chosen natural frequency wn and damping z. Instead of an integral the
/// outer loop takes off what an observer has learnt of disturbances (`LoopController::observe`):
///
///   a = a_ff + wn^2 e_p + 2 z wn e_v - d,                       thrust = m (a + g) along body z
///   torque = J (wn^2 e_R + 2 z wn e_w + ki integral(e_R)) + w x J w
///
/// e_R is the rotation vector from the present to the demanded attitude (on SO(3), in the body);
/// demanded rates come from the jerk.
class CascadedPid : public LoopController {
 public:
  using LoopController::LoopController;

 protected:
  [[nodiscard]] Vector3d demanded_torque(const RigidBodyState& state,
                                         const AttitudeDemand& demand,
                                         double dt,
                                         ControllerMemory& memory) const override;
};

}  // namespace pointflight
