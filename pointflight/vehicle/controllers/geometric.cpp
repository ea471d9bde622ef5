#include "pointflight/vehicle/controllers/geometric.hpp"

#include <algorithm>

#include "pointflight/core/constants.hpp"

namespace pointflight {
namespace {

/// The vector of a skew-symmetric matrix.
Vector3d vee(const Matrix3d& m) {
  return {m(2, 1), m(0, 2), m(1, 0)};
}

}  // namespace

Vector3d GeometricController::demanded_torque(const RigidBodyState& state,
                                              const AttitudeDemand& demand,
                                              double /*dt*/,
                                              ControllerMemory& /*memory*/) const {
  const Matrix3d R = state.q_world_body.toRotationMatrix();
  const Matrix3d& Rc = demand.R_world_body;
  const Vector3d& omega = state.omega_body;
  const Vector3d e_r = 0.5 * vee(Rc.transpose() * R - R.transpose() * Rc);
  const Vector3d omega_c = R.transpose() * (Rc * demand.omega_body);
  const Vector3d wn = attitude_frequency();
  const Vector3d alpha = -wn.cwiseProduct(wn).cwiseProduct(e_r) -
                         2.0 * attitude_damping().cwiseProduct(wn).cwiseProduct(omega - omega_c) -
                         omega.cross(omega_c);
  const Vector3d& inertia = settings().inertia_diagonal;
  return inertia.cwiseProduct(alpha) + omega.cross(inertia.cwiseProduct(omega));
}

}  // namespace pointflight
