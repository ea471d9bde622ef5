// One control period of vehicles under the geometric controller: as Autopilot, GeometricController
// and Multirotor do it for one, in numbers (number-inl.hpp).
#if defined(POINTFLIGHT_VEHICLE_FLIGHT_INL_HPP) == defined(HWY_TARGET_TOGGLE)
#ifdef POINTFLIGHT_VEHICLE_FLIGHT_INL_HPP
#undef POINTFLIGHT_VEHICLE_FLIGHT_INL_HPP
#else
#define POINTFLIGHT_VEHICLE_FLIGHT_INL_HPP
#endif

#include "pointflight/vehicle/internal/flight_kernel.hpp"
#include "pointflight/vehicle/internal/loops-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace pointflight::HWY_NAMESPACE {

/// All of a vehicle but its rotors' commands.
template <class N>
struct FlightNumbers {
  BodyNumbers<N> body;
  RotorNumbers<N> rotors;
  PerRotor<N> rotor_shares;  ///< Of their commanded speeds that they reach.
  Vec3<N> integral;          ///< Of the velocity loop.
  N yaw_torque, yaw;
  Vec3<N> asked;
  N turn;
  AirNumbers<N> air;
};

/// -pi to pi.
template <class N>
HWY_INLINE N wrapped(N angle) {
  return angle - N(2.0 * kPi) * ceiling(angle / N(2.0 * kPi) - N(0.5));
}

/// Thrust and torque for an acceleration (world, without gravity) within its limits.
template <class N>
HWY_INLINE WrenchNumbers<N> wrench_for(const FlightPlan& plan,
                                       const FlightNumbers<N>& flight,
                                       const Vec3<N>& acceleration) {
  const VehicleSettings& vehicle = *plan.vehicle;
  const Mat3<N> now = matrix_of(flight.body.q);
  const Vec3<N> f = tilt_limited(*plan.gains, acceleration + all_of<N>(Vector3d(0, 0, kGravity)));
  const AttitudeNumbers<N> demand = demanded_attitude(
      vehicle, now, f, all_of<N>(Vector3d(0, 0, 0)), heading_of(flight.yaw), flight.turn);
  return {demand.thrust, geometric_torque(vehicle, *plan.gains, now, flight.body.omega, demand)};
}

/// What a setpoint asks of the rotors together.
template <class N>
HWY_INLINE WrenchNumbers<N> demanded_wrench(const FlightPlan& plan,
                                            FlightLevel level,
                                            FlightNumbers<N>& flight) {
  const ControllerSettings& c = plan.vehicle->controller;
  if (level == FlightLevel::kBodyRates) {
    return {flight.turn, rate_torque(*plan.vehicle, *plan.gains, flight.body.omega, flight.asked)};
  }
  flight.yaw = wrapped(flight.yaw + flight.turn * N(plan.control_dt));
  if (level == FlightLevel::kAcceleration) {
    return wrench_for(plan, flight, allowed_acceleration(c, flight.asked));
  }
  const Vec3<N> v_ref = limited(flight.asked, c.speed_max);
  const Vec3<N> wanted =
      velocity_demand(*plan.gains, flight.body.v, v_ref, plan.control_dt, flight.integral);
  const Vec3<N> a = allowed_acceleration(c, wanted);
  keep_what_is_allowed(*plan.gains, flight.body.v, a, flight.integral);
  return wrench_for(plan, flight, a);
}

/// Rotor speeds that are commanded over the period.
template <class N>
HWY_INLINE void control(const FlightPlan& plan,
                        FlightLevel level,
                        FlightNumbers<N>& flight,
                        PerRotor<N>& commands) {
  if (level == FlightLevel::kRotorSpeeds) return;
  WrenchNumbers<N> wrench = demanded_wrench(plan, level, flight);
  filter_yaw(*plan.gains, plan.control_dt, wrench.torque, flight.yaw_torque);
  const Vec3<N> v_body = rotate(conjugate(flight.body.q), flight.body.v);
  speeds_for(*plan.vehicle, *plan.mixer, wrench, v_body, flight.body.omega, commands);
}

/// `Multirotor::step` for each physics step of a control period.
template <class N>
HWY_INLINE void integrate(const FlightPlan& plan,
                          FlightNumbers<N>& flight,
                          const PerRotor<N>& commands) {
  const RotorModel& rotor = plan.vehicle->rotor;
  PerRotor<N> targets;
  for (std::size_t i = 0; i < plan.vehicle->rotors.size(); ++i) {
    const N whole = least(greatest(commands[i], N(rotor.speed_min)), N(rotor.speed_max));
    targets[i] = choose(commands[i] > N(0.0), flight.rotor_shares[i] * whole, N(0.0));
  }
  for (int part = 0; part < plan.held * plan.parts; ++part) {
    runge_kutta(*plan.vehicle, flight.body, flight.rotors, targets, flight.air, plan.lag);
  }
}

}  // namespace pointflight::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
