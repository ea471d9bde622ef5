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

/// x'' = -wn^2 x - 2 z wn x' for x = speed - command, in closed form: exact at any `dt`.
void Multirotor::advance(std::span<RotorState> rotors,
                         std::span<const double> commands,
                         double dt,
                         const FlightConditions& conditions) const {
  const double wn = settings_.rotor.natural_frequency;
  const double z = settings_.rotor.damping;
  if (wn <= 0.0) return;
  const double decay = math::exp(-z * wn * dt);
  // x(t) = decay (x0 c + (x0' + z wn x0) s), c and s by the kind of damping
  double c = 1.0;
  double s = dt;
  const double under = 1.0 - z * z;
  if (under > 1e-8) {
    const double wd = wn * std::sqrt(under);
    const auto angle = math::sincos(wd * dt);
    c = angle.cos;
    s = angle.sin / wd;
  } else if (under < -1e-8) {
    const double wd = wn * std::sqrt(-under);
    const double grow = math::exp(wd * dt);
    c = 0.5 * (grow + 1.0 / grow);
    s = 0.5 * (grow - 1.0 / grow) / wd;
  }
  for (std::size_t i = 0; i < rotors.size(); ++i) {
    const double command = target(i, commands[i], conditions);
    const double x = rotors[i].speed - command;
    const double v = rotors[i].acceleration;
    rotors[i].speed = command + decay * (x * c + (v + z * wn * x) * s);
    rotors[i].acceleration = decay * (v * c - (z * wn * v + wn * wn * x) * s);
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
    const Vector3d f(-rotor.drag_coefficient * w * v_rotor.x(),
                     -rotor.drag_coefficient * w * v_rotor.y(),
                     thrust * rotor.thrust_share(v_rotor.z(), w));
    force += f;
    torque += place.position.cross(f);
    torque.z() +=
        place.yaw_sign * rotor.torque_coefficient * w * w * rotor.torque_share(v_rotor.z(), w);
  }
  // quadratic drag of the body along its axes
  force -=
      0.5 * kAirDensity * settings_.drag_area.cwiseProduct(v_body.cwiseAbs().cwiseProduct(v_body));

  rate.v_world = body.v_world;
  rate.a_world = body.q_world_body * force / settings_.mass - Vector3d(0, 0, kGravity);
  const Vector3d momentum = settings_.inertia_diagonal.cwiseProduct(body.omega_body) +
                            Vector3d(0, 0, rotor_momentum(rotors, &RotorState::speed));
  rate.torque_body = torque - body.omega_body.cross(momentum);
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
  // in two halves: a vehicle that tumbles at 7 rad/s then stays within 1e-9 m of the exact motion
  // over 10 s of 1 ms steps, not only within 1e-8
  for (int half = 0; half < 2; ++half) runge_kutta(state, commands, 0.5 * dt, conditions);
}

void Multirotor::runge_kutta(VehicleState& state,
                             std::span<const double> commands,
                             double dt,
                             const FlightConditions& conditions) const {
  if (settings_.rotor.natural_frequency <= 0.0) {
    for (std::size_t i = 0; i < commands.size(); ++i) {
      state.rotors[i] = {target(i, commands[i], conditions), 0.0};
    }
  }
  const std::vector<RotorState>& begin = state.rotors;
  std::vector<RotorState> middle = state.rotors;
  advance(middle, commands, 0.5 * dt, conditions);
  std::vector<RotorState> end = state.rotors;
  advance(end, commands, dt, conditions);

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
  state.rotors = std::move(end);
  for (RotorState& r : state.rotors) {
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
