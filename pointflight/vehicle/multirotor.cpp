#include "pointflight/vehicle/multirotor.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "pointflight/core/argument.hpp"
#include "pointflight/geometry/rotation.hpp"
#include "pointflight/vehicle/internal/scalar_numbers-inl.hpp"

namespace pointflight {

namespace hw = HWY_NAMESPACE;

Multirotor::Multirotor(const VehicleSettings& settings) : settings_(settings) {
  check_settings(settings, settings.path.empty() ? "vehicle" : settings.path);
  require_argument(settings.rotors.size() <= kMostRotors, "Multirotor: more than kMostRotors");
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

void Multirotor::step(VehicleState& state,
                      std::span<const double> commands,
                      double dt,
                      const FlightConditions& conditions) const {
  assert(commands.size() == settings_.rotors.size() && state.rotors.size() == commands.size());
  assert(conditions.rotor_shares.empty() || conditions.rotor_shares.size() == commands.size());
  assert(std::isfinite(dt));
  hw::PerRotor<double> targets;  // NOLINT: the same
  for (std::size_t i = 0; i < commands.size(); ++i) {
    targets[i] = target(i, commands[i], conditions);
  }
  hw::BodyNumbers<double> body = hw::numbers_of(state.body);
  hw::RotorNumbers<double> rotors;  // NOLINT: as many as there are are filled in
  hw::put(state.rotors, rotors);
  const hw::AirNumbers<double> air = hw::numbers_of(conditions);
  // in two halves: a vehicle that tumbles at 7 rad/s then stays within 1e-9 m of the exact motion
  // over 10 s of 1 ms steps, not only within 1e-8
  const StepLag lag = step_lag(settings_.rotor, 0.5 * dt);
  for (int half = 0; half < 2; ++half) {
    hw::runge_kutta(settings_, body, rotors, targets, air, lag);
  }
  state.body = hw::state_of(body);
  hw::put(rotors, state.rotors);
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
  hw::RotorNumbers<double> rotors;  // NOLINT: as many as there are are filled in
  hw::put(state.rotors, rotors);
  const auto rate =
      hw::rate_of(settings_, hw::numbers_of(state.body), rotors.speed, hw::numbers_of(conditions));
  const double spin_up = hw::rotor_momentum(settings_, rotors.acceleration);
  const Vector3d torque = hw::vector_of(rate.torque) - Vector3d(0, 0, spin_up);
  const Vector3d inertia = conditions.load_share * settings_.inertia_diagonal;
  return {hw::vector_of(rate.a), torque.cwiseQuotient(inertia)};
}

}  // namespace pointflight
