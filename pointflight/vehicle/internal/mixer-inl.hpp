// Rotor speeds for thrust and torque (`Mixer::speeds`), in numbers (number-inl.hpp).
#if defined(POINTFLIGHT_VEHICLE_MIXER_INL_HPP) == defined(HWY_TARGET_TOGGLE)
#ifdef POINTFLIGHT_VEHICLE_MIXER_INL_HPP
#undef POINTFLIGHT_VEHICLE_MIXER_INL_HPP
#else
#define POINTFLIGHT_VEHICLE_MIXER_INL_HPP
#endif

#include "pointflight/vehicle/internal/multirotor-inl.hpp"
#include "pointflight/vehicle/mixer.hpp"

HWY_BEFORE_NAMESPACE();
namespace pointflight::HWY_NAMESPACE {

/// `Wrench`
template <class N>
struct WrenchNumbers {
  N thrust;
  Vec3<N> torque;
};

/// In the order in which Eigen sums a vector that two doubles at a time fit into a register of.
template <class N>
HWY_INLINE N sum_of(const PerRotor<N>& values, std::size_t count) {
  const std::size_t pairs = count / 2;
  N even = values[0];
  N odd = values[1];
  if (pairs > 1) {
    N even_2 = values[2];
    N odd_2 = values[3];
    std::size_t i = 4;
    for (; i + 3 < count; i += 4) {
      even = even + values[i];
      odd = odd + values[i + 1];
      even_2 = even_2 + values[i + 2];
      odd_2 = odd_2 + values[i + 3];
    }
    even = even + even_2;
    odd = odd + odd_2;
    if (i + 1 < count) {
      even = even + values[i];
      odd = odd + values[i + 1];
    }
  }
  N sum = even + odd;
  return count % 2 == 1 ? sum + values[count - 1] : sum;
}

/// The largest share in [0, 1] of `part` that can be added to `base` without leaving the limits.
template <class N>
HWY_INLINE N feasible_share(const MixerModel& mixer,
                            const PerRotor<N>& base,
                            const PerRotor<N>& part,
                            std::size_t count) {
  const N most(mixer.thrust_max);
  const N least_thrust(mixer.thrust_min);
  const N zero(0.0);
  N share(1.0);
  for (std::size_t i = 0; i < count; ++i) {
    const N whole = base[i] + part[i];
    const auto above = both(whole > most, part[i] > zero);
    const auto below = both(whole < least_thrust, part[i] < zero);
    if (any(above)) share = choose(above, least(share, (most - base[i]) / part[i]), share);
    if (any(below)) share = choose(below, least(share, (least_thrust - base[i]) / part[i]), share);
  }
  return greatest(zero, share);
}

/// Thrust of each rotor. Roll and pitch first, then thrust, then yaw.
template <class N>
HWY_INLINE void thrusts_of(const MixerModel& mixer,
                           std::size_t count,
                           const WrenchNumbers<N>& wrench,
                           PerRotor<N>& thrusts) {
  PerRotor<N> tilt;
  PerRotor<N> yaw;
  for (std::size_t i = 0; i < count; ++i) {
    const auto& row = mixer.inverse[i];
    tilt[i] = N(row[1]) * wrench.torque.x + N(row[2]) * wrench.torque.y;
    yaw[i] = N(row[3]) * wrench.torque.z;
  }
  N highest = tilt[0];
  N lowest = tilt[0];
  for (std::size_t i = 1; i < count; ++i) {
    highest = greatest(highest, tilt[i]);
    lowest = least(lowest, tilt[i]);
  }
  // roll and pitch must fit between the limits at some thrust
  const N spread = highest - lowest;
  const N room(mixer.thrust_max - mixer.thrust_min);
  const auto wide = spread > room;
  if (any(wide)) {
    const N cut = choose(wide, room / spread, N(1.0));
    for (std::size_t i = 0; i < count; ++i) tilt[i] = tilt[i] * cut;
    highest = highest * cut;
    lowest = lowest * cut;
  }
  // thrust gives way to them
  PerRotor<N> lift;
  for (std::size_t i = 0; i < count; ++i) lift[i] = N(mixer.inverse[i][0]) * wrench.thrust;
  N top = lift[0] + tilt[0];
  N bottom = top;
  for (std::size_t i = 1; i < count; ++i) {
    top = greatest(top, lift[i] + tilt[i]);
    bottom = least(bottom, lift[i] + tilt[i]);
  }
  const N zero(0.0);
  const N room_low = N(mixer.thrust_min) - bottom;
  const N room_high = N(mixer.thrust_max) - top;
  const N shift = choose(room_low > zero, room_low, least(zero, room_high));
  const auto shifts = either(shift<zero, shift> zero);
  if (any(shifts)) {
    const N mean = sum_of(lift, count) / N(static_cast<double>(count));
    const N level =
        least(greatest(mean + shift, N(mixer.thrust_min) - lowest), N(mixer.thrust_max) - highest);
    for (std::size_t i = 0; i < count; ++i) lift[i] = choose(shifts, level, lift[i]);
  }
  // yaw takes what is left
  for (std::size_t i = 0; i < count; ++i) tilt[i] = lift[i] + tilt[i];
  const N share = feasible_share(mixer, tilt, yaw, count);
  for (std::size_t i = 0; i < count; ++i) thrusts[i] = tilt[i] + share * yaw[i];
}

/// Along a rotor's axis, m/s.
template <class N>
HWY_INLINE N climb_of(const RotorPlacement& place, const Vec3<N>& v_body, const Vec3<N>& omega) {
  return v_body.z + (omega.x * N(place.position.y()) - omega.y * N(place.position.x()));
}

/// `Mixer::speeds`
template <class N>
HWY_INLINE void speeds_for(const VehicleSettings& vehicle,
                           const MixerModel& mixer,
                           const WrenchNumbers<N>& wrench,
                           const Vec3<N>& v_body,
                           const Vec3<N>& omega,
                           PerRotor<N>& speeds) {
  const std::size_t count = vehicle.rotors.size();
  PerRotor<N> thrusts;
  thrusts_of(mixer, count, wrench, thrusts);
  const RotorModel& rotor = vehicle.rotor;
  for (std::size_t i = 0; i < count; ++i) {
    const N thrust = clamped(thrusts[i], N(mixer.thrust_min), N(mixer.thrust_max));
    speeds[i] = rotor_speed_for(rotor, thrust, climb_of(vehicle.rotors[i], v_body, omega));
    if (!rotor.advance_ratios.empty()) {
      speeds[i] = clamped(speeds[i], N(rotor.speed_min), N(rotor.speed_max));
    }
  }
}

}  // namespace pointflight::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
