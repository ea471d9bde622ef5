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

AttitudeDemand GeometricController::demanded_attitude(const RigidBodyState& state,
                                                      const Vector3d& a_world,
                                                      const Vector3d& jerk_world,
                                                      double yaw,
                                                      double yaw_rate) const {
  const Vector3d f = tilt_limited(a_world + Vector3d(0, 0, kGravity));
  const Matrix3d R_now = state.q_world_body.toRotationMatrix();
  // in free fall any attitude will do: the present one
  const double specific_thrust = f.norm();
  const Vector3d b3 =
      specific_thrust > 1e-3 ? Vector3d(f / specific_thrust) : Vector3d(R_now.col(2));
  AttitudeDemand demand;
  demand.R_world_body = attitude_from(b3, yaw, R_now);
  demand.omega_body = rates_of(demand.R_world_body, specific_thrust, jerk_world, yaw_rate);
  demand.thrust = settings().mass * std::max(0.0, f.dot(R_now.col(2)));
  return demand;
}

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
