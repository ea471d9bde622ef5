// Control loops (`LoopController`, `GeometricController`), in numbers (number-inl.hpp).
#if defined(POINTFLIGHT_VEHICLE_LOOPS_INL_HPP) == defined(HWY_TARGET_TOGGLE)
#ifdef POINTFLIGHT_VEHICLE_LOOPS_INL_HPP
#undef POINTFLIGHT_VEHICLE_LOOPS_INL_HPP
#else
#define POINTFLIGHT_VEHICLE_LOOPS_INL_HPP
#endif

#include "pointflight/vehicle/internal/loop_gains.hpp"
#include "pointflight/vehicle/internal/mixer-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace pointflight::HWY_NAMESPACE {

/// `AttitudeDemand`
template <class N>
struct AttitudeNumbers {
  Mat3<N> R;
  Vec3<N> omega;
  N thrust;
};

/// No longer than `length`.
template <class N>
HWY_INLINE Vec3<N> limited(const Vec3<N>& v, double length) {
  const N size = norm(v);
  const auto longer = size > N(length);
  return choose(longer, (N(length) / size) * v, v);
}

/// Each component within +-`most`.
template <class N>
HWY_INLINE Vec3<N> bounded(const Vec3<N>& v, double most) {
  const N low(-most);
  const N high(most);
  return {least(greatest(v.x, low), high),
          least(greatest(v.y, low), high),
          least(greatest(v.z, low), high)};
}

/// A demand (without gravity) cut to the limits of the vehicle: sideways, up, and down to a fifth
/// of gravity so that the rotors keep authority.
template <class N>
HWY_INLINE Vec3<N> allowed_acceleration(const ControllerSettings& c, const Vec3<N>& a) {
  const Vec3<N> sideways = limited(Vec3<N>{a.x, a.y, N(0.0)}, c.acceleration_max);
  return {sideways.x, sideways.y, clamped(a.z, N(-0.8 * kGravity), N(c.climb_acceleration_max))};
}

/// a = wn^2 integral(v_cmd - v) - 2 z wn v: v follows v_cmd as a second-order system without a
/// zero, and holds it in wind. `v_ref` is within the speed limit; the result is yet to be cut.
template <class N>
HWY_INLINE Vec3<N> velocity_demand(
    const LoopGains& gains, const Vec3<N>& v, const Vec3<N>& v_ref, double dt, Vec3<N>& integral) {
  integral = integral + N(dt) * times(all_of<N>(gains.velocity_square), v_ref - v);
  return integral - N(2.0) * times(all_of<N>(gains.velocity_damping), v);
}

/// Anti-windup: the integral is what the allowed acceleration needs.
template <class N>
HWY_INLINE void keep_what_is_allowed(const LoopGains& gains,
                                     const Vec3<N>& v,
                                     const Vec3<N>& allowed,
                                     Vec3<N>& integral) {
  integral = allowed + N(2.0) * times(all_of<N>(gains.velocity_damping), v);
}

/// Force per mass with its tilt cut to the limit: the vertical part is kept.
template <class N>
HWY_INLINE Vec3<N> tilt_limited(const LoopGains& gains, const Vec3<N>& f) {
  if (gains.tilt_is_free) return f;
  const N up = greatest(f.z, N(0.05 * kGravity));
  const N sideways = root(f.x * f.x + f.y * f.y);
  const N most = up * N(gains.tilt_tangent);
  const N scale = choose(sideways > most, most / sideways, N(1.0));
  return {scale * f.x, scale * f.y, up};
}

/// Attitude whose z axis is `b3` and whose x axis points to a heading; if b3 lies along the
/// heading, the nearest that `now` allows.
template <class N>
HWY_INLINE Mat3<N> attitude_from(const Vec3<N>& b3, const Heading<N>& heading, const Mat3<N>& now) {
  Vec3<N> b2 = cross(b3, Vec3<N>{heading.cos, heading.sin, N(0.0)});
  const auto along = dot(b2, b2) < N(1e-6);
  if (any(along)) b2 = choose(along, now.y - dot(b3, now.y) * b3, b2);
  const N square = dot(b2, b2);
  b2 = choose(square > N(0.0), b2 / root(square), b2);
  return {cross(b2, b3), b2, b3};
}

/// Rates that turn body z with the jerk, and yaw (Mellinger, Kumar 2011, eqs. 7 and 8), limited.
template <class N>
HWY_INLINE Vec3<N> demanded_rates(const ControllerSettings& c,
                                  const Mat3<N>& R,
                                  N specific_thrust,
                                  const Vec3<N>& jerk,
                                  N yaw_rate) {
  // h = (jerk - (b3 . jerk) b3) / |f|, w = (-h . b2, h . b1, yaw rate on b3)
  const Vec3<N> h = (jerk - dot(R.z, jerk) * R.z) / greatest(specific_thrust, N(1e-3));
  return bounded(Vec3<N>{-dot(h, R.y), dot(h, R.x), yaw_rate * R.z.z}, c.body_rate_max);
}

/// Attitude, rates and thrust for a force per mass within the tilt limit.
template <class N>
HWY_INLINE AttitudeNumbers<N> demanded_attitude(const VehicleSettings& vehicle,
                                                const Mat3<N>& now,
                                                const Vec3<N>& f,
                                                const Vec3<N>& jerk,
                                                const Heading<N>& heading,
                                                N yaw_rate) {
  // in free fall any attitude will do: the present one
  const N specific_thrust = norm(f);
  const Vec3<N> b3 = choose(specific_thrust > N(1e-3), f / specific_thrust, now.z);
  const Mat3<N> R = attitude_from(b3, heading, now);
  // the thrust is what the present attitude can turn into the demanded force
  return {R,
          demanded_rates(vehicle.controller, R, specific_thrust, jerk, yaw_rate),
          N(vehicle.mass) * greatest(N(0.0), dot(f, now.z))};
}

/// J a + w x J w.
template <class N>
HWY_INLINE Vec3<N> torque_for(const VehicleSettings& vehicle,
                              const Vec3<N>& alpha,
                              const Vec3<N>& omega) {
  const Vec3<N> inertia = all_of<N>(vehicle.inertia_diagonal);
  return times(inertia, alpha) + cross(omega, times(inertia, omega));
}

/// `GeometricController`
template <class N>
HWY_INLINE Vec3<N> geometric_torque(const VehicleSettings& vehicle,
                                    const LoopGains& gains,
                                    const Mat3<N>& R,
                                    const Vec3<N>& omega,
                                    const AttitudeNumbers<N>& demand) {
  const Mat3<N>& Rc = demand.R;
  const N half(0.5);
  // the vector of Rc^T R - R^T Rc
  const Vec3<N> e_r{half * (dot(Rc.z, R.y) - dot(R.z, Rc.y)),
                    half * (dot(Rc.x, R.z) - dot(R.x, Rc.z)),
                    half * (dot(Rc.y, R.x) - dot(R.y, Rc.x))};
  const Vec3<N> omega_c = into(R, out_of(Rc, demand.omega));
  const Vec3<N> alpha = -times(all_of<N>(gains.attitude_square), e_r) -
                        N(2.0) * times(all_of<N>(gains.attitude_damping), omega - omega_c) -
                        cross(omega, omega_c);
  return torque_for(vehicle, alpha, omega);
}

/// First order: the rate follows with the damping term of the attitude loop.
template <class N>
HWY_INLINE Vec3<N> rate_torque(const VehicleSettings& vehicle,
                               const LoopGains& gains,
                               const Vec3<N>& omega,
                               const Vec3<N>& demanded) {
  const Vec3<N> wanted = bounded(demanded, vehicle.controller.body_rate_max);
  const Vec3<N> alpha = N(2.0) * times(all_of<N>(gains.attitude_damping), wanted - omega);
  return torque_for(vehicle, alpha, omega);
}

/// Takes out of the demanded torque about z what a rotor adds by speeding up: J_r dw/dt beside
/// k_m w^2, which together answer a speed command with 1 + T s, T = J_r / (2 k_m w). A lag of that
/// time takes it out again.
template <class N>
HWY_INLINE void filter_yaw(const LoopGains& gains, double dt, Vec3<N>& torque, N& filtered) {
  filtered = filtered + N(dt / (gains.yaw_lag + dt)) * (torque.z - filtered);
  torque.z = filtered;
}

}  // namespace pointflight::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
