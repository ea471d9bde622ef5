// The multirotor's equations of motion (`Multirotor`), in numbers (number-inl.hpp).
#if defined(POINTFLIGHT_VEHICLE_MULTIROTOR_INL_HPP) == defined(HWY_TARGET_TOGGLE)
#ifdef POINTFLIGHT_VEHICLE_MULTIROTOR_INL_HPP
#undef POINTFLIGHT_VEHICLE_MULTIROTOR_INL_HPP
#else
#define POINTFLIGHT_VEHICLE_MULTIROTOR_INL_HPP
#endif

#include <array>
#include <cstddef>

#include "pointflight/vehicle/internal/rotor-inl.hpp"
#include "pointflight/vehicle/internal/rotor_lag.hpp"
#include "pointflight/vehicle/internal/vector-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace pointflight::HWY_NAMESPACE {

/// One of each rotor.
template <class N>
using PerRotor = std::array<N, kMostRotors>;

/// `RigidBodyState`
template <class N>
struct BodyNumbers {
  Vec3<N> p, v;
  Quat<N> q;
  Vec3<N> omega;
};

/// `RotorState` of all rotors.
template <class N>
struct RotorNumbers {
  PerRotor<N> speed, acceleration;
};

/// `FlightConditions` but for what they do to commands.
template <class N>
struct AirNumbers {
  Vec3<N> wind;
  N ground_z;
  N load_share;
};

/// Time derivative of a body's state.
template <class N>
struct BodyRate {
  Vec3<N> v, a;
  Quat<N> q;
  Vec3<N> torque;  ///< What changes the momentum of body and rotors, with w x (J w + h).
};

/// Cheeseman, Bennett; 1 where it would be less than 0.1 %.
template <class N>
HWY_INLINE N ground_effect(double radius, N height) {
  if (radius <= 0.0) return N(1.0);
  const auto high = height > N(10.0 * radius);
  if (all(high)) return N(1.0);
  const N share = N(radius) / (N(4.0) * greatest(height, N(0.5 * radius)));
  return choose(high, N(1.0), N(1.0) / (N(1.0) - share * share));
}

/// Of the rotors about body z, kg m^2/s (with the accelerations: its rate).
template <class N>
HWY_INLINE N rotor_momentum(const VehicleSettings& vehicle, const PerRotor<N>& speeds) {
  N sum(0.0);
  for (std::size_t i = 0; i < vehicle.rotors.size(); ++i) {
    sum = sum - N(vehicle.rotors[i].yaw_sign * vehicle.rotor.inertia) * speeds[i];
  }
  return sum;
}

/// What the rotors do to the body.
template <class N>
struct Push {
  Vec3<N> force, torque;
};

template <class N>
HWY_INLINE void add_rotor(Push<N>& push,
                          const RotorModel& rotor,
                          const RotorPlacement& place,
                          const Vec3<N>& v_rotor,
                          N effect,
                          N w) {
  // thrust, and drag of the blades against the air that the rotor moves through sideways
  const N thrust = N(rotor.thrust_coefficient) * w * w * effect;
  const RotorShares<N> shares = shares_at(rotor, v_rotor.z, w);
  const N drag = N(-rotor.drag_coefficient) * w;
  const Vec3<N> f{drag * v_rotor.x, drag * v_rotor.y, thrust * shares.thrust};
  push.force = push.force + f;
  push.torque = push.torque + cross(all_of<N>(place.position), f);
  push.torque.z =
      push.torque.z + N(place.yaw_sign * rotor.torque_coefficient) * w * w * shares.torque;
}

template <class N>
HWY_INLINE BodyRate<N> rate_of(const VehicleSettings& vehicle,
                               const BodyNumbers<N>& body,
                               const PerRotor<N>& speeds,
                               const AirNumbers<N>& air) {
  const Quat<N> q_body_world = conjugate(body.q);
  const Vec3<N> v_body = rotate(q_body_world, body.v - air.wind);
  const Vec3<N> up_body = rotate(q_body_world, Vec3<N>{N(0.0), N(0.0), N(1.0)});
  const N height = body.p.z - air.ground_z;
  Push<N> push{all_of<N>(Vector3d(0, 0, 0)), all_of<N>(Vector3d(0, 0, 0))};
  for (std::size_t i = 0; i < vehicle.rotors.size(); ++i) {
    const Vec3<N> place = all_of<N>(vehicle.rotors[i].position);
    const Vec3<N> v_rotor = v_body + cross(body.omega, place);
    const N effect = ground_effect(vehicle.rotor.radius, height + dot(up_body, place));
    add_rotor(push, vehicle.rotor, vehicle.rotors[i], v_rotor, effect, speeds[i]);
  }
  // quadratic drag of the body along its axes
  const Vec3<N> moving{magnitude(v_body.x) * v_body.x,
                       magnitude(v_body.y) * v_body.y,
                       magnitude(v_body.z) * v_body.z};
  push.force = push.force - N(0.5 * kAirDensity) * times(all_of<N>(vehicle.drag_area), moving);

  const Vec3<N> a = rotate(body.q, push.force) / (N(vehicle.mass) * air.load_share) -
                    all_of<N>(Vector3d(0, 0, kGravity));
  const Vec3<N> inertia = air.load_share * all_of<N>(vehicle.inertia_diagonal);
  const Vec3<N> momentum =
      times(inertia, body.omega) + Vec3<N>{N(0.0), N(0.0), rotor_momentum(vehicle, speeds)};
  const Vec3<N> drag_torque =
      norm(body.omega) * times(all_of<N>(vehicle.rotational_drag), body.omega);
  const Vec3<N> torque = push.torque - drag_torque - cross(body.omega, momentum);
  const Quat<N> turn = body.q * Quat<N>{body.omega.x, body.omega.y, body.omega.z, N(0.0)};
  return {body.v, a, N(0.5) * turn, torque};
}

/// The rotors' speeds later, on their way to `targets`.
template <class N>
HWY_INLINE void advance(const VehicleSettings& vehicle,
                        const RotorNumbers<N>& now,
                        const PerRotor<N>& targets,
                        const RotorLag& lag,
                        RotorNumbers<N>& later) {
  const double wn = vehicle.rotor.natural_frequency;
  const double z = vehicle.rotor.damping;
  const N decay(lag.decay);
  const N c(lag.c);
  const N s(lag.s);
  for (std::size_t i = 0; i < vehicle.rotors.size(); ++i) {
    const N x = now.speed[i] - targets[i];
    const N v = now.acceleration[i];
    later.speed[i] = targets[i] + decay * (x * c + (v + N(z * wn) * x) * s);
    later.acceleration[i] = decay * (v * c - (N(z * wn) * v + N(wn * wn) * x) * s);
  }
}

/// (a + 2 b + 2 c + d) / 6
template <template <class> class Many, class N>
HWY_INLINE Many<N> mean_of(const Many<N>& a, const Many<N>& b, const Many<N>& c, const Many<N>& d) {
  return N(1.0 / 6.0) * (a + N(2.0) * b + N(2.0) * c + d);
}

/// One step of RK4 for the body; rotors by their closed form, on their way to `targets`.
template <class N>
HWY_INLINE void runge_kutta(const VehicleSettings& vehicle,
                            BodyNumbers<N>& body,
                            RotorNumbers<N>& rotors,
                            const PerRotor<N>& targets,
                            const AirNumbers<N>& air,
                            const StepLag& step) {
  const std::size_t count = vehicle.rotors.size();
  // NOLINTBEGIN(cppcoreguidelines-pro-type-member-init): as many as there are rotors are filled in
  RotorNumbers<N> middle;
  RotorNumbers<N> end;
  // NOLINTEND(cppcoreguidelines-pro-type-member-init)
  if (vehicle.rotor.natural_frequency > 0.0) {
    advance(vehicle, rotors, targets, step.half, middle);
    advance(vehicle, rotors, targets, step.whole, end);
  } else {
    for (std::size_t i = 0; i < count; ++i) {
      rotors.speed[i] = middle.speed[i] = end.speed[i] = targets[i];
      rotors.acceleration[i] = middle.acceleration[i] = end.acceleration[i] = N(0.0);
    }
  }
  // the momentum of body and rotors together is what is integrated: what a rotor gains by speeding
  // up the body loses, to the last bit
  const Vec3<N> inertia = air.load_share * all_of<N>(vehicle.inertia_diagonal);
  const N zero(0.0);
  const Vec3<N> momentum =
      times(inertia, body.omega) + Vec3<N>{zero, zero, rotor_momentum(vehicle, rotors.speed)};
  const N spin_middle = rotor_momentum(vehicle, middle.speed);
  const N spin_end = rotor_momentum(vehicle, end.speed);
  const auto moved = [&](const BodyRate<N>& r, N h, N spin) HWY_ATTR {
    return BodyNumbers<N>{body.p + h * r.v,
                          body.v + h * r.a,
                          body.q + h * r.q,
                          by(momentum + h * r.torque - Vec3<N>{zero, zero, spin}, inertia)};
  };
  const N half(0.5 * step.dt);
  const N whole(step.dt);
  const BodyRate<N> k1 = rate_of(vehicle, body, rotors.speed, air);
  const BodyRate<N> k2 = rate_of(vehicle, moved(k1, half, spin_middle), middle.speed, air);
  const BodyRate<N> k3 = rate_of(vehicle, moved(k2, half, spin_middle), middle.speed, air);
  const BodyRate<N> k4 = rate_of(vehicle, moved(k3, whole, spin_end), end.speed, air);
  const BodyRate<N> mean{mean_of(k1.v, k2.v, k3.v, k4.v),
                         mean_of(k1.a, k2.a, k3.a, k4.a),
                         mean_of(k1.q, k2.q, k3.q, k4.q),
                         mean_of(k1.torque, k2.torque, k3.torque, k4.torque)};
  body = moved(mean, whole, spin_end);
  body.q = normalized(body.q);
  for (std::size_t i = 0; i < count; ++i) {
    const auto backwards = end.speed[i] < zero;
    rotors.speed[i] = choose(backwards, zero, end.speed[i]);
    rotors.acceleration[i] =
        choose(backwards, greatest(zero, end.acceleration[i]), end.acceleration[i]);
  }
}

}  // namespace pointflight::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
