#include "pointflight/vehicle/controllers/cascaded_pid.hpp"

#include <algorithm>

#include "pointflight/core/constants.hpp"
#include "pointflight/geometry/rotation.hpp"

namespace pointflight {
namespace {

constexpr double kAttitudeIntegralMax = 5.0;  // rad/s^2

}  // namespace

Vector3d CascadedPid::demanded_torque(const RigidBodyState& state,
                                      const AttitudeDemand& demand,
                                      double dt,
                                      ControllerMemory& memory) const {
  const ControllerSettings& c = settings().controller;
  const Quaterniond q_body_demand =
      state.q_world_body.conjugate() * Quaterniond(demand.R_world_body);
  const Vector3d e_r = rotation_vector(q_body_demand);
  const Vector3d e_w = q_body_demand * demand.omega_body - state.omega_body;
  const LoopDesign* loops[3] = {&c.roll_pitch, &c.roll_pitch, &c.yaw};
  Vector3d alpha;
  for (int axis = 0; axis < 3; ++axis) {
    const LoopDesign& loop = *loops[axis];
    const double wn = loop.natural_frequency;
    const double ki = loop.integral * wn * wn * wn;
    double& integral = memory.attitude_integral[axis];
    integral =
        std::clamp(integral + ki * e_r[axis] * dt, -kAttitudeIntegralMax, kAttitudeIntegralMax);
    alpha[axis] = wn * wn * e_r[axis] + 2.0 * loop.damping * wn * e_w[axis] + integral;
  }
  const Vector3d spin = settings().inertia_diagonal.cwiseProduct(state.omega_body);
  return settings().inertia_diagonal.cwiseProduct(alpha) + state.omega_body.cross(spin);
}

}  // namespace pointflight
