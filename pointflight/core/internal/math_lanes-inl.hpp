// The functions of core/math.hpp for as many doubles as a vector has. SLEEF's "cinz" functions are
// the same bits in vectors of any length, so that results do not depend on the instruction set.
//
// Included once a target by Highway's foreach_target; see core/internal/random_kernel.cpp.
#if defined(POINTFLIGHT_CORE_MATH_LANES_INL_HPP) == defined(HWY_TARGET_TOGGLE)
#ifdef POINTFLIGHT_CORE_MATH_LANES_INL_HPP
#undef POINTFLIGHT_CORE_MATH_LANES_INL_HPP
#else
#define POINTFLIGHT_CORE_MATH_LANES_INL_HPP
#endif

#include <hwy/highway.h>
#include <sleef.h>

#include <cstddef>

#include "pointflight/core/internal/simd_targets-inl.hpp"
#include "pointflight/core/math.hpp"

// Which of SLEEF's functions have this target's vectors; the others take numbers one by one.
#undef POINTFLIGHT_SLEEF
#undef POINTFLIGHT_SLEEF_VECTOR
#undef POINTFLIGHT_SLEEF_PAIR
#ifdef POINTFLIGHT_HAS_SLEEF_VECTORS
#if (HWY_TARGET == HWY_AVX3 || HWY_TARGET == HWY_AVX2) && defined(__clang__)
// clang passes long vectors as the whole source's target does and not as the function's: on the
// stack, where SLEEF does not look for them
#elif HWY_TARGET == HWY_AVX3
#define POINTFLIGHT_SLEEF(name, error) Sleef_cinz_##name##d8_##error##avx512fnofma
#define POINTFLIGHT_SLEEF_VECTOR __m512d
#define POINTFLIGHT_SLEEF_PAIR Sleef___m512d_2
#elif HWY_TARGET == HWY_AVX2
#define POINTFLIGHT_SLEEF(name, error) Sleef_cinz_##name##d4_##error##avx
#define POINTFLIGHT_SLEEF_VECTOR __m256d
#define POINTFLIGHT_SLEEF_PAIR Sleef___m256d_2
#elif HWY_TARGET == HWY_SSE4
#define POINTFLIGHT_SLEEF(name, error) Sleef_cinz_##name##d2_##error##sse4
#define POINTFLIGHT_SLEEF_VECTOR __m128d
#define POINTFLIGHT_SLEEF_PAIR Sleef___m128d_2
#elif HWY_TARGET == HWY_SSE2 && HWY_SSE2 != 0
#define POINTFLIGHT_SLEEF(name, error) Sleef_cinz_##name##d2_##error##sse2
#define POINTFLIGHT_SLEEF_VECTOR __m128d
#define POINTFLIGHT_SLEEF_PAIR Sleef___m128d_2
#endif
#endif

HWY_BEFORE_NAMESPACE();

// sleef.h declares what the compiler's own target has, and no more
#ifdef POINTFLIGHT_SLEEF
#if HWY_TARGET == HWY_AVX3 && !defined(Sleef___m512d_2_DEFINED)
#define Sleef___m512d_2_DEFINED
#define POINTFLIGHT_SLEEF_UNDECLARED
#elif HWY_TARGET == HWY_AVX2 && !defined(Sleef___m256d_2_DEFINED)
#define Sleef___m256d_2_DEFINED
#define POINTFLIGHT_SLEEF_UNDECLARED
#endif
#endif
#ifdef POINTFLIGHT_SLEEF_UNDECLARED
#undef POINTFLIGHT_SLEEF_UNDECLARED
struct POINTFLIGHT_SLEEF_PAIR {
  POINTFLIGHT_SLEEF_VECTOR x, y;
};
extern "C" {
POINTFLIGHT_SLEEF_VECTOR POINTFLIGHT_SLEEF(log, u10)(POINTFLIGHT_SLEEF_VECTOR);
POINTFLIGHT_SLEEF_VECTOR POINTFLIGHT_SLEEF(exp, u10)(POINTFLIGHT_SLEEF_VECTOR);
POINTFLIGHT_SLEEF_VECTOR POINTFLIGHT_SLEEF(erfc, u15)(POINTFLIGHT_SLEEF_VECTOR);
POINTFLIGHT_SLEEF_PAIR POINTFLIGHT_SLEEF(sincos, u10)(POINTFLIGHT_SLEEF_VECTOR);
}
#endif

namespace pointflight::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using DoubleTag = hn::CappedTag<double, 8>;
using DoubleLanes = hn::Vec<DoubleTag>;
inline constexpr DoubleTag kD;
inline constexpr std::size_t kDoubles = hn::MaxLanes(DoubleTag());

#ifdef POINTFLIGHT_SLEEF
HWY_INLINE DoubleLanes lanes_of(POINTFLIGHT_SLEEF_VECTOR raw) {
  DoubleLanes x;  // NOLINT(cppcoreguidelines-pro-type-member-init): written on the next line
  x.raw = raw;
  return x;
}
#else
template <class Function>
HWY_INLINE DoubleLanes each_lane(DoubleLanes x, const Function& function) {
  HWY_ALIGN double all[kDoubles];
  hn::Store(x, kD, all);
  for (double& one : all) one = function(one);
  return hn::Load(kD, all);
}
#endif

/// `math::log`
HWY_INLINE DoubleLanes log_lanes(DoubleLanes x) {
#ifdef POINTFLIGHT_SLEEF
  return lanes_of(POINTFLIGHT_SLEEF(log, u10)(x.raw));
#else
  return each_lane(x, [](double one) { return math::log(one); });
#endif
}

/// `math::exp`
HWY_INLINE DoubleLanes exp_lanes(DoubleLanes x) {
#ifdef POINTFLIGHT_SLEEF
  return lanes_of(POINTFLIGHT_SLEEF(exp, u10)(x.raw));
#else
  return each_lane(x, [](double one) { return math::exp(one); });
#endif
}

/// `math::normal_probability`
HWY_INLINE DoubleLanes normal_probability_lanes(DoubleLanes x) {
#ifdef POINTFLIGHT_SLEEF
  const DoubleLanes scaled = hn::Mul(hn::Neg(x), hn::Set(kD, math::kHalfRoot));
  return hn::Mul(hn::Set(kD, 0.5), lanes_of(POINTFLIGHT_SLEEF(erfc, u15)(scaled.raw)));
#else
  return each_lane(x, [](double one) { return math::normal_probability(one); });
#endif
}

/// Of as many angles.
struct SinCosLanes {
  DoubleLanes sin, cos;
};

/// `math::sincos`
HWY_INLINE SinCosLanes sincos_lanes(DoubleLanes x) {
#ifdef POINTFLIGHT_SLEEF
  const POINTFLIGHT_SLEEF_PAIR both = POINTFLIGHT_SLEEF(sincos, u10)(x.raw);
  return {lanes_of(both.x), lanes_of(both.y)};
#else
  return {each_lane(x, [](double one) { return math::sincos(one).sin; }),
          each_lane(x, [](double one) { return math::sincos(one).cos; })};
#endif
}

}  // namespace pointflight::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // POINTFLIGHT_CORE_MATH_LANES_INL_HPP
