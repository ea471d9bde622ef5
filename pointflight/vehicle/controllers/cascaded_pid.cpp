#include "pointflight/vehicle/controllers/cascaded_pid.hpp"

#include <algorithm>
#include <cmath>

#include "pointflight/core/constants.hpp"
#include "pointflight/core/math.hpp"
#include "pointflight/geometry/rotation.hpp"

namespace pointflight {
namespace {

constexpr double kAttitudeIntegralMax = 5.0;  // rad/s^2
constexpr double kIntegralZone = 1.5;         // m: farther away an integral only winds up

Vector3d limited(const Vector3d& v, double length) {
  const double norm = v.norm();
  return norm > length ? Vector3d(v * (length / norm)) : v;
}

/// Attitude whose z axis is `b3` and whose x axis points to heading `yaw`.
Matrix3d attitude_from(const Vector3d& b3, double yaw) {
  const auto heading = math::sincos(yaw);
  const Vector3d x_course(heading.cos, heading.sin, 0.0);
  const Vector3d b2 = b3.cross(x_course).normalized();
  Matrix3d rotation;
  rotation << b2.cross(b3), b2, b3;
  return rotation;
}

}  // namespace

CascadedPid::CascadedPid(const VehicleSettings& settings) : settings_(settings), mixer_(settings) {}

void CascadedPid::reset() {
  position_integral_.setZero();
  attitude_integral_.setZero();
}

std::vector<double> CascadedPid::update(const RigidBodyState& state,
                                        const PositionCommand& command,
                                        double dt) {
  const Vector3d a_world = demanded_acceleration(state, command, dt);
  const AttitudeDemand demand = demanded_attitude(state, command, a_world);
  return mixer_.speeds({demand.thrust, demanded_torque(state, demand, dt)});
}

Vector3d CascadedPid::demanded_acceleration(const RigidBodyState& state,
                                            const PositionCommand& command,
                                            double dt) {
  const ControllerSettings& c = settings_.controller;
  const Vector3d wn(
      c.horizontal.natural_frequency, c.horizontal.natural_frequency, c.vertical.natural_frequency);
  const Vector3d z(c.horizontal.damping, c.horizontal.damping, c.vertical.damping);
  const Vector3d ki = Vector3d(c.horizontal.integral, c.horizontal.integral, c.vertical.integral)
                          .cwiseProduct(wn.cwiseProduct(wn).cwiseProduct(wn));
  const Vector3d e_p = limited(command.p_world - state.p_world, c.error_max);
  const Vector3d e_v = command.v_world - state.v_world;
  const Vector3d feedback = wn.cwiseProduct(wn).cwiseProduct(e_p) +
                            2.0 * z.cwiseProduct(wn).cwiseProduct(e_v) + position_integral_;
  Vector3d a = command.a_world + feedback;

  // limits: sideways, up, and down to a fifth of gravity so that the rotors keep authority
  const Vector3d sideways = limited(Vector3d(a.x(), a.y(), 0.0), c.acceleration_max);
  const double up = std::clamp(a.z(), -0.8 * kGravity, c.climb_acceleration_max);
  const Vector3d allowed(sideways.x(), sideways.y(), up);
  // anti-windup: integrate where the demand is not cut, and never beyond its own limit
  for (int axis = 0; axis < 3; ++axis) {
    const bool cut = std::abs(a[axis] - allowed[axis]) > 1e-9;
    if (cut || std::abs(e_p[axis]) > kIntegralZone) continue;
    position_integral_[axis] = std::clamp(
        position_integral_[axis] + ki[axis] * e_p[axis] * dt, -c.integral_max, c.integral_max);
  }
  return allowed;
}

CascadedPid::AttitudeDemand CascadedPid::demanded_attitude(const RigidBodyState& state,
                                                           const PositionCommand& command,
                                                           const Vector3d& a_world) const {
  const ControllerSettings& c = settings_.controller;
  Vector3d f = a_world + Vector3d(0, 0, kGravity);
  // tilt limit: keep the vertical part, shorten the horizontal
  const double sideways = std::hypot(f.x(), f.y());
  const double sideways_max = f.z() * math::tan(c.tilt_max_deg * kDegree);
  if (sideways > sideways_max) {
    f.x() *= sideways_max / sideways;
    f.y() *= sideways_max / sideways;
  }
  const double specific_thrust = f.norm();
  const Vector3d b3 = f / specific_thrust;
  const Matrix3d rotation = attitude_from(b3, command.yaw);

  // rates that follow the jerk: h = (jerk - (b3 . jerk) b3) / |f|, w = (-h.b2, h.b1, yaw rate on
  // b3)
  const Vector3d h = (command.jerk_world - b3.dot(command.jerk_world) * b3) / specific_thrust;
  Vector3d omega(-h.dot(rotation.col(1)), h.dot(rotation.col(0)), command.yaw_rate * b3.z());
  omega = omega.cwiseMax(-c.body_rate_max).cwiseMin(c.body_rate_max);

  AttitudeDemand demand;
  demand.q_world_body = Quaterniond(rotation);
  demand.omega_body = omega;
  // the thrust that the present attitude can turn into the demanded force
  const Vector3d b3_now = state.q_world_body * Vector3d::UnitZ();
  demand.thrust = settings_.mass * std::max(0.0, f.dot(b3_now));
  return demand;
}

Vector3d CascadedPid::demanded_torque(const RigidBodyState& state,
                                      const AttitudeDemand& demand,
                                      double dt) {
  const ControllerSettings& c = settings_.controller;
  const Quaterniond q_body_demand = state.q_world_body.conjugate() * demand.q_world_body;
  const Vector3d e_r = rotation_vector(q_body_demand);
  const Vector3d e_w = q_body_demand * demand.omega_body - state.omega_body;
  const LoopDesign* loops[3] = {&c.roll_pitch, &c.roll_pitch, &c.yaw};
  Vector3d alpha;
  for (int axis = 0; axis < 3; ++axis) {
    const LoopDesign& loop = *loops[axis];
    const double wn = loop.natural_frequency;
    const double ki = loop.integral * wn * wn * wn;
    attitude_integral_[axis] = std::clamp(attitude_integral_[axis] + ki * e_r[axis] * dt,
                                          -kAttitudeIntegralMax,
                                          kAttitudeIntegralMax);
    alpha[axis] =
        wn * wn * e_r[axis] + 2.0 * loop.damping * wn * e_w[axis] + attitude_integral_[axis];
  }
  const Vector3d spin = settings_.inertia_diagonal.cwiseProduct(state.omega_body);
  return settings_.inertia_diagonal.cwiseProduct(alpha) + state.omega_body.cross(spin);
}

std::unique_ptr<Controller> make_controller(const VehicleSettings& settings) {
  return std::make_unique<CascadedPid>(settings);
}

}  // namespace pointflight
