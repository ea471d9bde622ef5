#pragma once

#include "pointflight/vehicle/controllers/loops.hpp"

namespace pointflight {

/// Geometric tracking on SE(3) (Lee, Leok, McClamroch, CDC 2010, eqs. 10, 11, 15, 16, with gains
/// per mass and inertia from the loops' designs):
///
///   f = m (a + g e3) . R e3,                    b3 along a + g e3
///   M = J (-wn^2 e_R - 2 z wn e_W) + W x J W - J (W x R^T Rc Wc)
///   e_R = (Rc^T R - R^T Rc)^v / 2,              e_W = W - R^T Rc Wc
///
/// For aggressive flight: no attitude is singular, the thrust may point anywhere (a tilt limit of
/// 90 degrees or more is none), and almost all attitudes come back. Wc comes from the jerk, its
/// derivative is left out.
class GeometricController : public LoopController {
 public:
  using LoopController::LoopController;

 protected:
  [[nodiscard]] Vector3d demanded_torque(const RigidBodyState& state,
                                         const AttitudeDemand& demand,
                                         double dt,
                                         ControllerMemory& memory) const override;
};

}  // namespace pointflight
