// Rotors (`RotorModel`): shares of the static thrust and torque, speeds for a thrust, and the way
// to a commanded speed, in numbers (number-inl.hpp).
#if defined(POINTFLIGHT_VEHICLE_ROTOR_INL_HPP) == defined(HWY_TARGET_TOGGLE)
#ifdef POINTFLIGHT_VEHICLE_ROTOR_INL_HPP
#undef POINTFLIGHT_VEHICLE_ROTOR_INL_HPP
#else
#define POINTFLIGHT_VEHICLE_ROTOR_INL_HPP
#endif

#include "pointflight/core/constants.hpp"
#include "pointflight/vehicle/airframe.hpp"
#include "pointflight/vehicle/internal/number-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace pointflight::HWY_NAMESPACE {

/// J = v / (n D).
template <class N>
HWY_INLINE N advance_ratio(N climb, N speed, double radius) {
  return N(kPi) * climb / (greatest(speed, N(1.0)) * N(radius));
}

/// A piece of the curves of thrust and torque: from (x, thrust, torque) by steps of each.
template <class N>
struct CurvePiece {
  N x, dx, thrust, d_thrust, torque, d_torque;
};

/// The piece that each lane's `x` lies on.
template <class N>
HWY_INLINE CurvePiece<N> piece_at(const RotorModel& rotor, N x) {
  const auto piece = [&rotor](std::size_t i) HWY_ATTR {
    const double* js = &rotor.advance_ratios[i];
    const double* thrusts = &rotor.thrust_shares[i];
    const double* torques = &rotor.torque_shares[i];
    return CurvePiece<N>{N(js[0]),
                         N(js[1] - js[0]),
                         N(thrusts[0]),
                         N(thrusts[1] - thrusts[0]),
                         N(torques[0]),
                         N(torques[1] - torques[0])};
  };
  CurvePiece<N> found = piece(0);
  for (std::size_t i = 1; i + 1 < rotor.advance_ratios.size(); ++i) {
    const auto beyond = x >= N(rotor.advance_ratios[i]);
    if (!any(beyond)) break;
    const CurvePiece<N> next = piece(i);
    found.x = choose(beyond, next.x, found.x);
    found.dx = choose(beyond, next.dx, found.dx);
    found.thrust = choose(beyond, next.thrust, found.thrust);
    found.d_thrust = choose(beyond, next.d_thrust, found.d_thrust);
    found.torque = choose(beyond, next.torque, found.torque);
    found.d_torque = choose(beyond, next.d_torque, found.d_torque);
  }
  return found;
}

/// Of the static thrust and torque.
template <class N>
struct RotorShares {
  N thrust, torque;
};

/// `RotorModel::shares`: constant beyond the first and the last ratio.
template <class N>
HWY_INLINE RotorShares<N> shares_at(const RotorModel& rotor, N climb, N speed) {
  if (rotor.advance_ratios.empty()) return {N(1.0), N(1.0)};
  const RotorShares<N> first{N(rotor.thrust_shares.front()), N(rotor.torque_shares.front())};
  const N ratio = advance_ratio(climb, speed, rotor.radius);
  const auto before = ratio <= N(rotor.advance_ratios.front());
  if (all(before)) return first;
  const N x = least(ratio, N(rotor.advance_ratios.back()));
  const CurvePiece<N> piece = piece_at(rotor, x);
  const N along = x - piece.x;
  return {choose(before, first.thrust, piece.thrust + piece.d_thrust * along / piece.dx),
          choose(before, first.torque, piece.torque + piece.d_torque * along / piece.dx)};
}

/// `RotorModel::speed_for`. Where the share is constant w^2 = T / (k_f share). Along a straight
/// piece of it, share = y + m J with J = c / w, c = pi v / R, and y w^2 + m c w = T / k_f. The
/// piece whose own J it has is the one.
template <class N>
HWY_INLINE N rotor_speed_for(const RotorModel& rotor, N thrust, N climb) {
  const N square = thrust / N(rotor.thrust_coefficient);
  if (rotor.advance_ratios.empty()) return root(square);
  constexpr double kRounding = 1e-9;
  const N slow = root(square / N(rotor.thrust_shares.front()));
  auto done = advance_ratio(climb, slow, rotor.radius) <= N(rotor.advance_ratios.front());
  N found = choose(done, slow, N(rotor.speed_max));
  if (all(done)) return found;
  const N scale = N(kPi) * climb / N(rotor.radius);
  for (std::size_t i = 1; i < rotor.advance_ratios.size(); ++i) {
    const double* js = &rotor.advance_ratios[i - 1];
    const double slope = (rotor.thrust_shares[i] - rotor.thrust_shares[i - 1]) / (js[1] - js[0]);
    const double base = rotor.thrust_shares[i - 1] - slope * js[0];
    const N half = N(0.5 * slope) * scale;
    const N speed = (root(greatest(N(0.0), half * half + N(base) * square)) - half) / N(base);
    const N ratio = advance_ratio(climb, speed, rotor.radius);
    const auto fits = both(ratio >= N(js[0] - kRounding), ratio <= N(js[1] + kRounding));
    const auto now = but_not(fits, done);
    found = choose(now, speed, found);
    done = either(done, fits);
    if (all(done)) break;
  }
  return found;
}

}  // namespace pointflight::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
