#include "pointflight/vehicle/multirotor.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "pointflight/core/constants.hpp"
#include "pointflight/core/math.hpp"
#include "pointflight/geometry/rotation.hpp"

namespace pointflight {

/// Time derivative of a RigidBodyState.
struct Multirotor::Rate {
  Vector3d v_world;
  Vector3d a_world;
  Eigen::Vector4d q_dot;  ///< x, y, z, w as Eigen stores coefficients.
  Vector3d torque_body;   ///< What changes the momentum of body and rotors, with w x (J w + h).
};

/// Of x'' = -wn^2 x - 2 z wn x' over some time t: x(t) = decay (x0 c + (x0' + z wn x0) s).
struct Multirotor::RotorResponse {
  double decay = 1.0, c = 1.0, s = 0.0;
};

/// What one step of the integrator works with: both halves of a step have it in common.
struct Multirotor::Stages {
  std::vector<double> targets;          ///< Speeds that the rotors go to, rad/s.
  RotorResponse half, whole;            ///< Until its middle and its end.
  std::vector<RotorState> middle, end;  ///< The rotors there.
};

Multirotor::Multirotor(const VehicleSettings& settings) : settings_(settings) {
  check_settings(settings, settings.path.empty() ? "vehicle" : settings.path);
}

VehicleState Multirotor::hover_at(const Vector3d& p_world, double yaw) const {
  VehicleState state;
  state.body.p_world = p_world;
  state.body.q_world_body = quaternion_from_rpy(0.0, 0.0, yaw);
  state.rotors.assign(settings_.rotors.size(), {settings_.hover_speed(), 0.0});
  return state;
}

double Multirotor::target(std::size_t i, double command, const FlightConditions& conditions) const {
  if (!(command > 0.0)) return 0.0;
  const double most = conditions.speed_share * settings_.rotor.speed_max;
  const double whole = std::min(std::max(command, settings_.rotor.speed_min), most);
  return conditions.rotor_shares.empty() ? whole : conditions.rotor_shares[i] * whole;
}

double Multirotor::ground_effect(double height) const {
  const double radius = settings_.rotor.radius;
  if (radius <= 0.0 || height > 10.0 * radius) return 1.0;  // less than 0.1 %
  const double share = radius / (4.0 * std::max(height, 0.5 * radius));
  return 1.0 / (1.0 - share * share);
}

/// c and s by the kind of damping, in closed form: exact at any `dt`.
Multirotor::RotorResponse Multirotor::response(double dt) const {
  const double wn = settings_.rotor.natural_frequency;
  const double z = settings_.rotor.damping;
  const double decay = math::exp(-z * wn * dt);
  const double under = 1.0 - z * z;
  if (under > 1e-8) {
    const double wd = wn * std::sqrt(under);
    const auto angle = math::sincos(wd * dt);
    return {decay, angle.cos, angle.sin / wd};
  }
  if (under < -1e-8) {
    const double wd = wn * std::sqrt(-under);
    const double grow = math::exp(wd * dt);
    return {decay, 0.5 * (grow + 1.0 / grow), 0.5 * (grow - 1.0 / grow) / wd};
  }
  return {decay, 1.0, dt};
}

void Multirotor::advance(std::span<const RotorState> now,
                         std::span<const double> targets,
                         const RotorResponse& response,
                         std::span<RotorState> later) const {
  const double wn = settings_.rotor.natural_frequency;
  const double z = settings_.rotor.damping;
  const auto [decay, c, s] = response;
  for (std::size_t i = 0; i < now.size(); ++i) {
    const double x = now[i].speed - targets[i];
    const double v = now[i].acceleration;
    later[i].speed = targets[i] + decay * (x * c + (v + z * wn * x) * s);
    later[i].acceleration = decay * (v * c - (z * wn * v + wn * wn * x) * s);
  }
}

/// Of the rotors about body z, kg m^2/s (with the accelerations: its rate).
double Multirotor::rotor_momentum(std::span<const RotorState> rotors,
                                  double RotorState::*member) const {
  double sum = 0.0;
  for (std::size_t i = 0; i < rotors.size(); ++i) {
    sum -= settings_.rotors[i].yaw_sign * settings_.rotor.inertia * rotors[i].*member;
  }
  return sum;
}

Multirotor::Rate Multirotor::rate(const RigidBodyState& body,
                                  std::span<const RotorState> rotors,
                                  const FlightConditions& conditions) const {
  const RotorModel& rotor = settings_.rotor;
  Rate rate;

  const Quaterniond q_body_world = body.q_world_body.conjugate();
  const Vector3d v_body = q_body_world * (body.v_world - conditions.wind_world);
  const Vector3d up_body = q_body_world * Vector3d::UnitZ();
  const double height = body.p_world.z() - conditions.ground_z;
  Vector3d force = Vector3d::Zero();
  Vector3d torque = Vector3d::Zero();
  for (std::size_t i = 0; i < rotors.size(); ++i) {
    const RotorPlacement& place = settings_.rotors[i];
    const double w = rotors[i].speed;
    // thrust, and drag of the blades against the air that the rotor moves through sideways
    const Vector3d v_rotor = v_body + body.omega_body.cross(place.position);
    const double thrust =
        rotor.thrust_coefficient * w * w * ground_effect(height + up_body.dot(place.position));
    const RotorModel::Shares shares = rotor.shares(v_rotor.z(), w);
    const Vector3d f(-rotor.drag_coefficient * w * v_rotor.x(),
                     -rotor.drag_coefficient * w * v_rotor.y(),
                     thrust * shares.thrust);
    force += f;
    torque += place.position.cross(f);
    torque.z() += place.yaw_sign * rotor.torque_coefficient * w * w * shares.torque;
  }
  // quadratic drag of the body along its axes
  force -=
      0.5 * kAirDensity * settings_.drag_area.cwiseProduct(v_body.cwiseAbs().cwiseProduct(v_body));

  rate.v_world = body.v_world;
  rate.a_world = body.q_world_body * force / settings_.mass - Vector3d(0, 0, kGravity);
  const Vector3d momentum = settings_.inertia_diagonal.cwiseProduct(body.omega_body) +
                            Vector3d(0, 0, rotor_momentum(rotors, &RotorState::speed));
  const Vector3d drag_torque =
      body.omega_body.norm() * settings_.rotational_drag.cwiseProduct(body.omega_body);
  rate.torque_body = torque - drag_torque - body.omega_body.cross(momentum);
  const Quaterniond omega(0.0, body.omega_body.x(), body.omega_body.y(), body.omega_body.z());
  rate.q_dot = 0.5 * (body.q_world_body * omega).coeffs();
  return rate;
}

void Multirotor::step(VehicleState& state,
                      std::span<const double> commands,
                      double dt,
                      const FlightConditions& conditions) const {
  assert(commands.size() == settings_.rotors.size() && state.rotors.size() == commands.size());
  assert(conditions.rotor_shares.empty() || conditions.rotor_shares.size() == commands.size());
  assert(std::isfinite(dt));
  Stages stages;
  stages.targets.resize(commands.size());
  for (std::size_t i = 0; i < commands.size(); ++i) {
    stages.targets[i] = target(i, commands[i], conditions);
  }
  stages.half = response(0.5 * (0.5 * dt));
  stages.whole = response(0.5 * dt);
  stages.middle.resize(commands.size());
  stages.end.resize(commands.size());
  // in two halves: a vehicle that tumbles at 7 rad/s then stays within 1e-9 m of the exact motion
  // over 10 s of 1 ms steps, not only within 1e-8
  for (int half = 0; half < 2; ++half) runge_kutta(state, stages, 0.5 * dt, conditions);
}

void Multirotor::runge_kutta(VehicleState& state,
                             Stages& stages,
                             double dt,
                             const FlightConditions& conditions) const {
  auto& [targets, to_middle, to_end, middle, end] = stages;
  std::vector<RotorState>& begin = state.rotors;
  if (settings_.rotor.natural_frequency > 0.0) {
    advance(begin, targets, to_middle, middle);
    advance(begin, targets, to_end, end);
  } else {
    for (std::size_t i = 0; i < targets.size(); ++i) {
      begin[i] = middle[i] = end[i] = {targets[i], 0.0};
    }
  }

  // the momentum of body and rotors together is what is integrated: what a rotor gains by speeding
  // up the body loses, to the last bit
  const Vector3d& inertia = settings_.inertia_diagonal;
  const auto spin = [&](const std::vector<RotorState>& rotors) {
    return Vector3d(0, 0, rotor_momentum(rotors, &RotorState::speed));
  };
  const Vector3d momentum = inertia.cwiseProduct(state.body.omega_body) + spin(begin);
  const auto advanced = [&](const Rate& r, double h, const std::vector<RotorState>& rotors) {
    RigidBodyState s = state.body;
    s.p_world += h * r.v_world;
    s.v_world += h * r.a_world;
    s.q_world_body.coeffs() += h * r.q_dot;
    s.omega_body = (momentum + h * r.torque_body - spin(rotors)).cwiseQuotient(inertia);
    return s;
  };
  const Rate k1 = rate(state.body, begin, conditions);
  const Rate k2 = rate(advanced(k1, 0.5 * dt, middle), middle, conditions);
  const Rate k3 = rate(advanced(k2, 0.5 * dt, middle), middle, conditions);
  const Rate k4 = rate(advanced(k3, dt, end), end, conditions);
  const auto mean = [](const auto& a, const auto& b, const auto& c, const auto& d) {
    return (1.0 / 6.0) * (a + 2.0 * b + 2.0 * c + d);
  };
  Rate r;
  r.v_world = mean(k1.v_world, k2.v_world, k3.v_world, k4.v_world);
  r.a_world = mean(k1.a_world, k2.a_world, k3.a_world, k4.a_world);
  r.q_dot = mean(k1.q_dot, k2.q_dot, k3.q_dot, k4.q_dot);
  r.torque_body = mean(k1.torque_body, k2.torque_body, k3.torque_body, k4.torque_body);
  state.body = advanced(r, dt, end);
  state.body.q_world_body.normalize();
  begin.swap(end);
  for (RotorState& r : begin) {
    if (r.speed < 0.0) r = {0.0, std::max(0.0, r.acceleration)};
  }
}

double Multirotor::shaft_power(const VehicleState& state,
                               const FlightConditions& conditions) const {
  const RotorModel& rotor = settings_.rotor;
  const RigidBodyState& body = state.body;
  const Vector3d v_body = body.q_world_body.conjugate() * (body.v_world - conditions.wind_world);
  double power = 0.0;
  for (std::size_t i = 0; i < state.rotors.size(); ++i) {
    const double w = state.rotors[i].speed;
    const double climb = (v_body + body.omega_body.cross(settings_.rotors[i].position)).z();
    // a windmill gives nothing back
    power += rotor.torque_coefficient * w * w * w * std::max(0.0, rotor.torque_share(climb, w));
  }
  return power;
}

BodyAcceleration Multirotor::acceleration(const VehicleState& state,
                                          const FlightConditions& conditions) const {
  const Rate r = rate(state.body, state.rotors, conditions);
  const Vector3d spin_up(0, 0, rotor_momentum(state.rotors, &RotorState::acceleration));
  return {r.a_world, (r.torque_body - spin_up).cwiseQuotient(settings_.inertia_diagonal)};
}

}  // namespace pointflight
