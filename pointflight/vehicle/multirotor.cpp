#include "pointflight/vehicle/multirotor.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "pointflight/core/constants.hpp"
#include "pointflight/geometry/rotation.hpp"

namespace pointflight {

/// Time derivative of a VehicleState.
struct Multirotor::Rate {
  Vector3d v_world;
  Vector3d a_world;
  Eigen::Vector4d q_dot;  ///< x, y, z, w as Eigen stores coefficients.
  Vector3d alpha_body;
  std::vector<RotorState> rotors;  ///< speed: its rate; acceleration: its rate.
};

Multirotor::Multirotor(const VehicleSettings& settings) : settings_(settings) {}

VehicleState Multirotor::hover_at(const Vector3d& p_world, double yaw) const {
  VehicleState state;
  state.body.p_world = p_world;
  state.body.q_world_body = quaternion_from_rpy(0.0, 0.0, yaw);
  state.rotors.assign(settings_.rotors.size(), {settings_.hover_speed(), 0.0});
  return state;
}

double Multirotor::clamped(double command, double speed_share) const {
  if (!(command > 0.0)) return 0.0;
  const double most = speed_share * settings_.rotor.speed_max;
  return std::min(std::max(command, settings_.rotor.speed_min), most);
}

double Multirotor::ground_effect(double height) const {
  const double radius = settings_.rotor.radius;
  if (radius <= 0.0 || height > 10.0 * radius) return 1.0;  // less than 0.1 %
  const double share = radius / (4.0 * std::max(height, 0.5 * radius));
  return 1.0 / (1.0 - share * share);
}

Multirotor::Rate Multirotor::rate(const VehicleState& state,
                                  std::span<const double> commands,
                                  const FlightConditions& conditions) const {
  const RotorModel& rotor = settings_.rotor;
  const RigidBodyState& body = state.body;
  const bool ideal = rotor.natural_frequency <= 0.0;
  Rate rate;
  rate.rotors.resize(state.rotors.size());

  const Quaterniond q_body_world = body.q_world_body.conjugate();
  const Vector3d v_body = q_body_world * (body.v_world - conditions.wind_world);
  const Vector3d up_body = q_body_world * Vector3d::UnitZ();
  const double height = body.p_world.z() - conditions.ground_z;
  Vector3d force = Vector3d::Zero();
  Vector3d torque = Vector3d::Zero();
  for (std::size_t i = 0; i < state.rotors.size(); ++i) {
    const RotorPlacement& place = settings_.rotors[i];
    const double w = state.rotors[i].speed;
    const double dw = state.rotors[i].acceleration;
    // thrust, and drag of the blades against the air that the rotor moves through sideways
    const Vector3d v_rotor = v_body + body.omega_body.cross(place.position);
    const Vector3d f(
        -rotor.drag_coefficient * w * v_rotor.x(),
        -rotor.drag_coefficient * w * v_rotor.y(),
        rotor.thrust_coefficient * w * w * ground_effect(height + up_body.dot(place.position)));
    force += f;
    torque += place.position.cross(f);
    torque.z() += place.yaw_sign * (rotor.torque_coefficient * w * w + rotor.inertia * dw);
    // the rotor's spin is -s J_r w e3: turning the body turns it too
    torque -= body.omega_body.cross(Vector3d(0, 0, -place.yaw_sign * rotor.inertia * w));

    if (!ideal) {
      const double wn = rotor.natural_frequency;
      rate.rotors[i].speed = dw;
      rate.rotors[i].acceleration = wn * wn * (clamped(commands[i], conditions.speed_share) - w) -
                                    2.0 * rotor.damping * wn * dw;
    }
  }
  // quadratic drag of the body along its axes
  force -=
      0.5 * kAirDensity * settings_.drag_area.cwiseProduct(v_body.cwiseAbs().cwiseProduct(v_body));

  rate.v_world = body.v_world;
  rate.a_world = body.q_world_body * force / settings_.mass - Vector3d(0, 0, kGravity);
  const Vector3d spin = settings_.inertia_diagonal.cwiseProduct(body.omega_body);
  rate.alpha_body =
      (torque - body.omega_body.cross(spin)).cwiseQuotient(settings_.inertia_diagonal);
  const Quaterniond omega(0.0, body.omega_body.x(), body.omega_body.y(), body.omega_body.z());
  rate.q_dot = 0.5 * (body.q_world_body * omega).coeffs();
  return rate;
}

void Multirotor::step(VehicleState& state,
                      std::span<const double> commands,
                      double dt,
                      const FlightConditions& conditions) const {
  assert(commands.size() == state.rotors.size());
  if (settings_.rotor.natural_frequency <= 0.0) {
    for (std::size_t i = 0; i < commands.size(); ++i) {
      state.rotors[i] = {clamped(commands[i], conditions.speed_share), 0.0};
    }
  }
  const auto advanced = [&](const Rate& r, double h) {
    VehicleState s = state;
    s.body.p_world += h * r.v_world;
    s.body.v_world += h * r.a_world;
    s.body.q_world_body.coeffs() += h * r.q_dot;
    s.body.omega_body += h * r.alpha_body;
    for (std::size_t i = 0; i < s.rotors.size(); ++i) {
      s.rotors[i].speed += h * r.rotors[i].speed;
      s.rotors[i].acceleration += h * r.rotors[i].acceleration;
    }
    return s;
  };
  const Rate k1 = rate(state, commands, conditions);
  const Rate k2 = rate(advanced(k1, 0.5 * dt), commands, conditions);
  const Rate k3 = rate(advanced(k2, 0.5 * dt), commands, conditions);
  const Rate k4 = rate(advanced(k3, dt), commands, conditions);
  const auto mean = [dt](const auto& a, const auto& b, const auto& c, const auto& d) {
    return (dt / 6.0) * (a + 2.0 * b + 2.0 * c + d);
  };
  RigidBodyState& body = state.body;
  body.p_world += mean(k1.v_world, k2.v_world, k3.v_world, k4.v_world);
  body.v_world += mean(k1.a_world, k2.a_world, k3.a_world, k4.a_world);
  body.q_world_body.coeffs() += mean(k1.q_dot, k2.q_dot, k3.q_dot, k4.q_dot);
  body.omega_body += mean(k1.alpha_body, k2.alpha_body, k3.alpha_body, k4.alpha_body);
  for (std::size_t i = 0; i < state.rotors.size(); ++i) {
    RotorState& r = state.rotors[i];
    r.speed += mean(k1.rotors[i].speed, k2.rotors[i].speed, k3.rotors[i].speed, k4.rotors[i].speed);
    r.acceleration += mean(k1.rotors[i].acceleration,
                           k2.rotors[i].acceleration,
                           k3.rotors[i].acceleration,
                           k4.rotors[i].acceleration);
    if (r.speed < 0.0) r = {0.0, std::max(0.0, r.acceleration)};
  }
  body.q_world_body.normalize();
}

BodyAcceleration Multirotor::acceleration(const VehicleState& state,
                                          std::span<const double> commands,
                                          const FlightConditions& conditions) const {
  const Rate r = rate(state, commands, conditions);
  return {r.a_world, r.alpha_body};
}

}  // namespace pointflight
