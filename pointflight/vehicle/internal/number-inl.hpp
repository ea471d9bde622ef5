// What dynamics and control loops compute with: a double, or lanes of doubles with a vehicle each.
// Both do the same operations in the same order, so that a vehicle's bits do not depend on which it
// is.
//
// Included once a target by Highway's foreach_target, or once for scalar code.
#if defined(POINTFLIGHT_VEHICLE_NUMBER_INL_HPP) == defined(HWY_TARGET_TOGGLE)
#ifdef POINTFLIGHT_VEHICLE_NUMBER_INL_HPP
#undef POINTFLIGHT_VEHICLE_NUMBER_INL_HPP
#else
#define POINTFLIGHT_VEHICLE_NUMBER_INL_HPP
#endif

#include <cmath>

#include "pointflight/core/internal/simd_targets-inl.hpp"
// before highway.h
#include "pointflight/core/internal/math_lanes-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace pointflight::HWY_NAMESPACE {

/// A truth value for each lane.
struct LaneMask {
  hn::Mask<DoubleTag> raw;
};

/// As many doubles as a vector has.
struct Lanes {
  DoubleLanes raw;
  Lanes() = default;
  HWY_INLINE Lanes(double all) : raw(hn::Set(kD, all)) {}  // NOLINT: as good as a number
  HWY_INLINE explicit Lanes(DoubleLanes lanes) : raw(lanes) {}
};

HWY_INLINE Lanes operator+(Lanes a, Lanes b) {
  return Lanes(hn::Add(a.raw, b.raw));
}
HWY_INLINE Lanes operator-(Lanes a, Lanes b) {
  return Lanes(hn::Sub(a.raw, b.raw));
}
HWY_INLINE Lanes operator*(Lanes a, Lanes b) {
  return Lanes(hn::Mul(a.raw, b.raw));
}
HWY_INLINE Lanes operator/(Lanes a, Lanes b) {
  return Lanes(hn::Div(a.raw, b.raw));
}
HWY_INLINE Lanes operator-(Lanes a) {
  return Lanes(hn::Neg(a.raw));
}
HWY_INLINE LaneMask operator<(Lanes a, Lanes b) {
  return {hn::Lt(a.raw, b.raw)};
}
HWY_INLINE LaneMask operator>(Lanes a, Lanes b) {
  return {hn::Gt(a.raw, b.raw)};
}
HWY_INLINE LaneMask operator<=(Lanes a, Lanes b) {
  return {hn::Le(a.raw, b.raw)};
}
HWY_INLINE LaneMask operator>=(Lanes a, Lanes b) {
  return {hn::Ge(a.raw, b.raw)};
}

/// Of each lane, or of the one number.
///@{
HWY_INLINE Lanes root(Lanes a) {
  return Lanes(hn::Sqrt(a.raw));
}
HWY_INLINE double root(double a) {
  return std::sqrt(a);
}
HWY_INLINE Lanes ceiling(Lanes a) {
  return Lanes(hn::Ceil(a.raw));
}
HWY_INLINE double ceiling(double a) {
  return std::ceil(a);
}
HWY_INLINE Lanes magnitude(Lanes a) {
  return Lanes(hn::Abs(a.raw));
}
HWY_INLINE double magnitude(double a) {
  return std::abs(a);
}
HWY_INLINE Lanes choose(LaneMask condition, Lanes a, Lanes b) {
  return Lanes(hn::IfThenElse(condition.raw, a.raw, b.raw));
}
HWY_INLINE double choose(bool condition, double a, double b) {
  return condition ? a : b;
}
HWY_INLINE LaneMask both(LaneMask a, LaneMask b) {
  return {hn::And(a.raw, b.raw)};
}
HWY_INLINE bool both(bool a, bool b) {
  return a && b;
}
HWY_INLINE LaneMask either(LaneMask a, LaneMask b) {
  return {hn::Or(a.raw, b.raw)};
}
HWY_INLINE bool either(bool a, bool b) {
  return a || b;
}
HWY_INLINE LaneMask but_not(LaneMask a, LaneMask b) {
  return {hn::AndNot(b.raw, a.raw)};
}
HWY_INLINE bool but_not(bool a, bool b) {
  return a && !b;
}
HWY_INLINE bool any(LaneMask a) {
  return !hn::AllFalse(kD, a.raw);
}
HWY_INLINE bool any(bool a) {
  return a;
}
HWY_INLINE bool all(LaneMask a) {
  return hn::AllTrue(kD, a.raw);
}
HWY_INLINE bool all(bool a) {
  return a;
}
///@}

/// As std::min and std::max: the first if both are equal.
///@{
template <class N>
HWY_INLINE N least(N a, N b) {
  return choose(b < a, b, a);
}
template <class N>
HWY_INLINE N greatest(N a, N b) {
  return choose(a < b, b, a);
}
/// As std::clamp.
template <class N>
HWY_INLINE N clamped(N x, N low, N high) {
  return choose(x < low, low, choose(high < x, high, x));
}
///@}

/// Cosine and sine.
template <class N>
struct Heading {
  N cos, sin;
};
HWY_INLINE Heading<Lanes> heading_of(Lanes yaw) {
  const SinCosLanes both = sincos_lanes(yaw.raw);
  return {Lanes(both.cos), Lanes(both.sin)};
}
HWY_INLINE Heading<double> heading_of(double yaw) {
  const auto both = math::sincos(yaw);
  return {both.cos, both.sin};
}

}  // namespace pointflight::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
