// Many draws at once: Philox 4x32-10 and Box-Muller in lanes.
#include "pointflight/core/internal/random_kernel.hpp"

#include <algorithm>

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

/// Two draws per lane.
struct DrawLanes {
  DoubleLanes u, v;
};

/// How many vectors of counters go through the rounds side by side: each round waits for the one
/// before, so that one alone would leave the processor idle. Four need 32 registers.
inline constexpr std::size_t kSide = HWY_TARGET == HWY_AVX3 ? 4 : 2;
inline constexpr std::size_t kAtOnce = kSide * kDoubles;

/// Of the counters from `index` on (Salmon, Moraes, Dror, Shaw, SC 2011). Upper halves of lanes
/// hold what products have left there; only lower ones count.
HWY_INLINE void uniform_lanes(const DrawAddress& address,
                              std::uint64_t index,
                              DrawLanes (&made)[kSide]) {
  WordLanes c0[kSide];
  WordLanes c1[kSide];
  WordLanes c2[kSide];
  WordLanes c3[kSide];
  for (std::size_t s = 0; s < kSide; ++s) {
    c0[s] = hn::Add(hn::Set(kW, index + s * kDoubles), hn::Iota(kW, 0));
    c1[s] = hn::ShiftRight<32>(c0[s]);
    c2[s] = hn::Set(kW, std::uint64_t{address.entity});
    c3[s] = hn::Set(kW, std::uint64_t{address.stream});
  }
  const WordLanes m0 = hn::Set(kW, std::uint64_t{0xD2511F53u});
  const WordLanes m1 = hn::Set(kW, std::uint64_t{0xCD9E8D57u});
  auto k0 = static_cast<std::uint32_t>(address.seed);
  auto k1 = static_cast<std::uint32_t>(address.seed >> 32u);
  for (int round = 0; round < 10; ++round) {
    const WordLanes key0 = hn::Set(kW, std::uint64_t{k0});
    const WordLanes key1 = hn::Set(kW, std::uint64_t{k1});
    for (std::size_t s = 0; s < kSide; ++s) {
      const WordLanes p0 = product(c0[s], m0);
      const WordLanes p1 = product(c2[s], m1);
      c0[s] = hn::Xor(hn::Xor(hn::ShiftRight<32>(p1), c1[s]), key0);
      c2[s] = hn::Xor(hn::Xor(hn::ShiftRight<32>(p0), c3[s]), key1);
      c1[s] = p1;
      c3[s] = p0;
    }
    k0 += 0x9E3779B9u;
    k1 += 0xBB67AE85u;
  }
  const WordLanes lower = hn::Set(kW, std::uint64_t{0xFFFFFFFFu});
  for (std::size_t s = 0; s < kSide; ++s) {
    made[s].u = to_unit_interval(c0[s], hn::And(c1[s], lower));
    made[s].v = to_unit_interval(c2[s], hn::And(c3[s], lower));
  }
}

/// Box-Muller.
HWY_INLINE DrawLanes normal_lanes(const DrawLanes& uniform) {
  const DoubleLanes one = hn::Set(kD, 1.0);
  const DoubleLanes radius =
      hn::Sqrt(hn::Mul(hn::Set(kD, -2.0), log_lanes(hn::Sub(one, uniform.u))));
  const SinCosLanes angle = sincos_lanes(hn::Mul(hn::Set(kD, 2.0 * kPi), uniform.v));
  return {hn::Mul(radius, angle.cos), hn::Mul(radius, angle.sin)};
}

static void fill_uniform(
    const DrawAddress& address, std::uint64_t first, std::size_t count, double* u, double* v) {
  HWY_ALIGN double last_u[kAtOnce];
  HWY_ALIGN double last_v[kAtOnce];
  DrawLanes made[kSide];
  for (std::size_t i = 0; i < count; i += kAtOnce) {
    uniform_lanes(address, first + i, made);
    const bool is_last = i + kAtOnce > count;
    double* const to_u = is_last ? last_u : u + i;
    double* const to_v = is_last ? last_v : v + i;
    for (std::size_t s = 0; s < kSide; ++s) {
      hn::StoreU(made[s].u, kD, to_u + s * kDoubles);
      hn::StoreU(made[s].v, kD, to_v + s * kDoubles);
    }
    if (!is_last) continue;
    std::copy_n(last_u, count - i, u + i);
    std::copy_n(last_v, count - i, v + i);
  }
}

static void fill_normal(
    const DrawAddress& address, std::uint64_t first, std::size_t count, double* u, double* v) {
  fill_uniform(address, first, count, u, v);
  std::size_t i = 0;
  for (; i + kDoubles <= count; i += kDoubles) {
    const DrawLanes made = normal_lanes({hn::LoadU(kD, u + i), hn::LoadU(kD, v + i)});
    hn::StoreU(made.u, kD, u + i);
    hn::StoreU(made.v, kD, v + i);
  }
  if (i == count) return;
  HWY_ALIGN double last_u[kDoubles] = {};
  HWY_ALIGN double last_v[kDoubles] = {};
  std::copy_n(u + i, count - i, last_u);
  std::copy_n(v + i, count - i, last_v);
  const DrawLanes made = normal_lanes({hn::Load(kD, last_u), hn::Load(kD, last_v)});
  hn::Store(made.u, kD, last_u);
  hn::Store(made.v, kD, last_v);
  std::copy_n(last_u, count - i, u + i);
  std::copy_n(last_v, count - i, v + i);
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
