// Many draws at once: Philox 4x32-10 and Box-Muller in lanes.
#include "pointflight/core/internal/random_kernel.hpp"

#include "pointflight/core/constants.hpp"
#include "pointflight/core/internal/simd_targets-inl.hpp"
// for foreach_target
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pointflight/core/internal/random_kernel.cpp"
#include <hwy/foreach_target.h>
// after foreach_target
#include "pointflight/core/internal/math_lanes-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace pointflight::HWY_NAMESPACE {

using WordTag = hn::RebindToUnsigned<DoubleTag>;
using WordLanes = hn::Vec<WordTag>;
inline constexpr WordTag kW;

/// Of the lower halves of each lane.
HWY_INLINE WordLanes product(WordLanes a, WordLanes b) {
#if HWY_TARGET == HWY_SCALAR
  constexpr std::uint64_t kLower = 0xFFFFFFFFu;
  return hn::Set(kW, (hn::GetLane(a) & kLower) * (hn::GetLane(b) & kLower));
#else
  const hn::Repartition<std::uint32_t, WordTag> halves;
  return hn::MulEven(hn::BitCast(halves, a), hn::BitCast(halves, b));
#endif
}

/// 53 bits as a double in [0, 1): what a conversion of whole numbers below 2^53 gives is exact.
HWY_INLINE DoubleLanes to_unit_interval(WordLanes high, WordLanes low) {
  const WordLanes bits = hn::ShiftRight<11>(hn::Or(hn::ShiftLeft<32>(high), low));
  const hn::RebindToSigned<DoubleTag> whole;
  return hn::Mul(hn::ConvertTo(kD, hn::BitCast(whole, bits)), hn::Set(kD, 0x1p-53));
}

struct UniformLanes {
  DoubleLanes u, v;
};

/// Of the counters from `index` on (Salmon, Moraes, Dror, Shaw, SC 2011). Upper halves of lanes
/// hold what products have left there; only lower ones count.
HWY_INLINE UniformLanes uniform_lanes(const DrawAddress& address, std::uint64_t index) {
  const WordLanes counter = hn::Add(hn::Set(kW, index), hn::Iota(kW, 0));
  WordLanes c0 = counter;
  WordLanes c1 = hn::ShiftRight<32>(counter);
  WordLanes c2 = hn::Set(kW, std::uint64_t{address.entity});
  WordLanes c3 = hn::Set(kW, std::uint64_t{address.stream});
  const WordLanes m0 = hn::Set(kW, std::uint64_t{0xD2511F53u});
  const WordLanes m1 = hn::Set(kW, std::uint64_t{0xCD9E8D57u});
  auto k0 = static_cast<std::uint32_t>(address.seed);
  auto k1 = static_cast<std::uint32_t>(address.seed >> 32u);
  for (int round = 0; round < 10; ++round) {
    const WordLanes p0 = product(c0, m0);
    const WordLanes p1 = product(c2, m1);
    c0 = hn::Xor(hn::Xor(hn::ShiftRight<32>(p1), c1), hn::Set(kW, std::uint64_t{k0}));
    c2 = hn::Xor(hn::Xor(hn::ShiftRight<32>(p0), c3), hn::Set(kW, std::uint64_t{k1}));
    c1 = p1;
    c3 = p0;
    k0 += 0x9E3779B9u;
    k1 += 0xBB67AE85u;
  }
  const WordLanes lower = hn::Set(kW, std::uint64_t{0xFFFFFFFFu});
  return {to_unit_interval(c0, hn::And(c1, lower)), to_unit_interval(c2, hn::And(c3, lower))};
}

HWY_INLINE UniformLanes normal_lanes(const UniformLanes& uniform) {
  const DoubleLanes one = hn::Set(kD, 1.0);
  const DoubleLanes radius =
      hn::Sqrt(hn::Mul(hn::Set(kD, -2.0), log_lanes(hn::Sub(one, uniform.u))));
  const SinCosLanes angle = sincos_lanes(hn::Mul(hn::Set(kD, 2.0 * kPi), uniform.v));
  return {hn::Mul(radius, angle.cos), hn::Mul(radius, angle.sin)};
}

/// Calls `make` for `kDoubles` draws after the other and writes `count` pairs; of the last call as
/// many as are wanted.
template <class Make>
HWY_INLINE void fill(std::size_t count, double* u, double* v, const Make& make) {
  std::size_t i = 0;
  for (; i + kDoubles <= count; i += kDoubles) {
    const UniformLanes made = make(i);
    hn::StoreU(made.u, kD, u + i);
    hn::StoreU(made.v, kD, v + i);
  }
  if (i == count) return;
  HWY_ALIGN double last_u[kDoubles];
  HWY_ALIGN double last_v[kDoubles];
  const UniformLanes made = make(i);
  hn::Store(made.u, kD, last_u);
  hn::Store(made.v, kD, last_v);
  for (std::size_t k = 0; i < count; ++i, ++k) {
    u[i] = last_u[k];
    v[i] = last_v[k];
  }
}

static void fill_uniform(
    const DrawAddress& address, std::uint64_t first, std::size_t count, double* u, double* v) {
  fill(count, u, v, [&](std::size_t i) { return uniform_lanes(address, first + i); });
}

static void fill_normal(
    const DrawAddress& address, std::uint64_t first, std::size_t count, double* u, double* v) {
  fill(count, u, v, [&](std::size_t i) { return normal_lanes(uniform_lanes(address, first + i)); });
}

}  // namespace pointflight::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace pointflight {
namespace {

HWY_EXPORT(fill_uniform);
HWY_EXPORT(fill_normal);

}  // namespace

void draw_uniforms(
    const DrawAddress& address, std::uint64_t first, std::size_t count, double* u, double* v) {
  HWY_DYNAMIC_DISPATCH(fill_uniform)(address, first, count, u, v);
}

void draw_normals(
    const DrawAddress& address, std::uint64_t first, std::size_t count, double* u, double* v) {
  HWY_DYNAMIC_DISPATCH(fill_normal)(address, first, count, u, v);
}

}  // namespace pointflight
#endif  // HWY_ONCE
