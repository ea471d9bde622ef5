// Eight floats or integers at a time on any instruction set: one vector on AVX2 and AVX-512, two
// halves on SSE4 and NEON. Only operations that IEEE 754 rounds the same everywhere, no fused
// multiply-add and no approximate reciprocal: results are the same bits on every target.
//
// Included once a target by Highway's foreach_target; see render/internal/beam_kernel.cpp.
#if defined(POINTFLIGHT_CORE_SIMD8_INL_HPP) == defined(HWY_TARGET_TOGGLE)
#ifdef POINTFLIGHT_CORE_SIMD8_INL_HPP
#undef POINTFLIGHT_CORE_SIMD8_INL_HPP
#else
#define POINTFLIGHT_CORE_SIMD8_INL_HPP
#endif

#include <hwy/highway.h>

#include <cstddef>
#include <cstdint>

#include "pointflight/core/internal/chosen_lanes.hpp"
#include "pointflight/core/internal/simd_targets-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace pointflight::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using FloatTag = hn::CappedTag<float, 8>;
using IntTag = hn::RebindToSigned<FloatTag>;
using UintTag = hn::RebindToUnsigned<FloatTag>;
inline constexpr FloatTag kF;
inline constexpr IntTag kI;
inline constexpr UintTag kU;
inline constexpr std::size_t kWidth = hn::MaxLanes(FloatTag());
inline constexpr std::size_t kParts = 8 / kWidth;
static_assert(kWidth * kParts == 8);

/// Applies an operation to each part.
#define POINTFLIGHT_EACH(expression) \
  for (std::size_t p = 0; p < kParts; ++p) out.v[p] = expression;

struct F8 {
  hn::Vec<FloatTag> v[kParts];
};
struct U8 {
  hn::Vec<UintTag> v[kParts];
};
struct I8 {
  hn::Vec<IntTag> v[kParts];
};
struct M8 {
  hn::Mask<FloatTag> v[kParts];
};

// NOLINTBEGIN(cppcoreguidelines-pro-type-member-init): each part is written
POINTFLIGHT_INLINE F8 splat(float x) {
  F8 out;
  POINTFLIGHT_EACH(hn::Set(kF, x))
  return out;
}
/// From eight floats on a 32-byte border.
POINTFLIGHT_INLINE F8 load(const float* x) {
  F8 out;
  POINTFLIGHT_EACH(hn::Load(kF, x + p * kWidth))
  return out;
}
POINTFLIGHT_INLINE F8 load_unaligned(const float* x) {
  F8 out;
  POINTFLIGHT_EACH(hn::LoadU(kF, x + p * kWidth))
  return out;
}
POINTFLIGHT_INLINE void store(const F8& a, float* x) {
  for (std::size_t p = 0; p < kParts; ++p) hn::Store(a.v[p], kF, x + p * kWidth);
}
POINTFLIGHT_INLINE void store_unaligned(const F8& a, float* x) {
  for (std::size_t p = 0; p < kParts; ++p) hn::StoreU(a.v[p], kF, x + p * kWidth);
}
/// Eight bytes as floats.
POINTFLIGHT_INLINE F8 load_bytes(const std::uint8_t* x) {
  F8 out;
  const hn::Rebind<std::uint8_t, FloatTag> bytes;
  POINTFLIGHT_EACH(hn::ConvertTo(kF, hn::PromoteTo(kI, hn::LoadU(bytes, x + p * kWidth))))
  return out;
}
POINTFLIGHT_INLINE F8 operator+(const F8& a, const F8& b) {
  F8 out;
  POINTFLIGHT_EACH(hn::Add(a.v[p], b.v[p]))
  return out;
}
POINTFLIGHT_INLINE F8 operator-(const F8& a, const F8& b) {
  F8 out;
  POINTFLIGHT_EACH(hn::Sub(a.v[p], b.v[p]))
  return out;
}
POINTFLIGHT_INLINE F8 operator*(const F8& a, const F8& b) {
  F8 out;
  POINTFLIGHT_EACH(hn::Mul(a.v[p], b.v[p]))
  return out;
}
POINTFLIGHT_INLINE F8 operator/(const F8& a, const F8& b) {
  F8 out;
  POINTFLIGHT_EACH(hn::Div(a.v[p], b.v[p]))
  return out;
}
POINTFLIGHT_INLINE F8 sqrt(const F8& a) {
  F8 out;
  POINTFLIGHT_EACH(hn::Sqrt(a.v[p]))
  return out;
}
POINTFLIGHT_INLINE F8 abs(const F8& a) {
  F8 out;
  POINTFLIGHT_EACH(hn::Abs(a.v[p]))
  return out;
}
POINTFLIGHT_INLINE F8 max(const F8& a, const F8& b) {
  F8 out;
  POINTFLIGHT_EACH(hn::Max(a.v[p], b.v[p]))
  return out;
}
POINTFLIGHT_INLINE F8 min(const F8& a, const F8& b) {
  F8 out;
  POINTFLIGHT_EACH(hn::Min(a.v[p], b.v[p]))
  return out;
}
POINTFLIGHT_INLINE M8 operator<=(const F8& a, const F8& b) {
  M8 out;
  POINTFLIGHT_EACH(hn::Le(a.v[p], b.v[p]))
  return out;
}
POINTFLIGHT_INLINE M8 operator<(const F8& a, const F8& b) {
  M8 out;
  POINTFLIGHT_EACH(hn::Lt(a.v[p], b.v[p]))
  return out;
}
POINTFLIGHT_INLINE M8 operator&(const M8& a, const M8& b) {
  M8 out;
  POINTFLIGHT_EACH(hn::And(a.v[p], b.v[p]))
  return out;
}
POINTFLIGHT_INLINE F8 select(const M8& condition, const F8& yes, const F8& no) {
  F8 out;
  POINTFLIGHT_EACH(hn::IfThenElse(condition.v[p], yes.v[p], no.v[p]))
  return out;
}
POINTFLIGHT_INLINE I8 select(const M8& condition, const I8& yes, const I8& no) {
  I8 out;
  POINTFLIGHT_EACH(hn::IfThenElse(hn::RebindMask(kI, condition.v[p]), yes.v[p], no.v[p]))
  return out;
}
/// a and not b
POINTFLIGHT_INLINE M8 without(const M8& a, const M8& b) {
  M8 out;
  POINTFLIGHT_EACH(hn::AndNot(b.v[p], a.v[p]))
  return out;
}
/// Zero if the condition does not hold.
POINTFLIGHT_INLINE I8 keep(const M8& condition, const I8& a) {
  I8 out;
  POINTFLIGHT_EACH(hn::IfThenElseZero(hn::RebindMask(kI, condition.v[p]), a.v[p]))
  return out;
}
/// Bit i is lane i.
POINTFLIGHT_INLINE std::uint32_t bits(const M8& a) {
  std::uint32_t all = 0;
  for (std::size_t p = 0; p < kParts; ++p) {
    std::uint8_t part[8];
    hn::StoreMaskBits(kF, a.v[p], part);
    all |= static_cast<std::uint32_t>(part[0]) << (p * kWidth);
  }
  return all;
}

POINTFLIGHT_INLINE U8 splat_bits(std::uint32_t x) {
  U8 out;
  POINTFLIGHT_EACH(hn::Set(kU, x))
  return out;
}
POINTFLIGHT_INLINE U8 operator&(const U8& a, const U8& b) {
  U8 out;
  POINTFLIGHT_EACH(hn::And(a.v[p], b.v[p]))
  return out;
}
POINTFLIGHT_INLINE U8 operator+(const U8& a, const U8& b) {
  U8 out;
  POINTFLIGHT_EACH(hn::Add(a.v[p], b.v[p]))
  return out;
}
POINTFLIGHT_INLINE U8 operator*(const U8& a, const U8& b) {
  U8 out;
  POINTFLIGHT_EACH(hn::Mul(a.v[p], b.v[p]))
  return out;
}
template <int kBits>
POINTFLIGHT_INLINE U8 right(const U8& a) {
  U8 out;
  POINTFLIGHT_EACH(hn::ShiftRight<kBits>(a.v[p]))
  return out;
}
template <int kBits>
POINTFLIGHT_INLINE U8 left(const U8& a) {
  U8 out;
  POINTFLIGHT_EACH(hn::ShiftLeft<kBits>(a.v[p]))
  return out;
}
/// The upper eight bits as a signed number.
POINTFLIGHT_INLINE F8 signed_top_byte(const U8& a) {
  F8 out;
  POINTFLIGHT_EACH(hn::ConvertTo(kF, hn::ShiftRight<24>(hn::BitCast(kI, a.v[p]))))
  return out;
}
/// Numbers below 2^31 as floats.
POINTFLIGHT_INLINE F8 to_float(const U8& a) {
  F8 out;
  POINTFLIGHT_EACH(hn::ConvertTo(kF, hn::BitCast(kI, a.v[p])))
  return out;
}
POINTFLIGHT_INLINE F8 as_float(const U8& a) {
  F8 out;
  POINTFLIGHT_EACH(hn::BitCast(kF, a.v[p]))
  return out;
}
/// table[index], one number after the other: where vectors are shorter than the table.
POINTFLIGHT_INLINE F8 look_up_each(const float* table, const U8& index) {
  std::uint32_t places[8];
  float values[8];
  for (std::size_t p = 0; p < kParts; ++p) hn::StoreU(index.v[p], kU, places + p * kWidth);
  for (std::size_t i = 0; i < 8; ++i) values[i] = table[places[i]];
  return load_unaligned(values);
}
/// table[index]
POINTFLIGHT_INLINE F8 look_up(const float* table, const U8& index) {
  if constexpr (kWidth < 8) return look_up_each(table, index);
  F8 out;
  POINTFLIGHT_EACH(hn::GatherIndex(kF, table, hn::BitCast(kI, index.v[p])))
  return out;
}
/// table[index] for indices below four.
POINTFLIGHT_INLINE F8 look_up4(const float* table, const U8& index) {
  if constexpr (kWidth < 4) return look_up_each(table, index);
  F8 out;
  const auto values = hn::LoadDup128(kF, table);
  POINTFLIGHT_EACH(hn::TableLookupLanes(values, hn::IndicesFromVec(kF, index.v[p])))
  return out;
}
/// table[index] for indices below eight.
POINTFLIGHT_INLINE F8 look_up8(const float* table, const U8& index) {
  if constexpr (kWidth < 8) return look_up_each(table, index);
  F8 out;
  const auto values = hn::LoadU(kF, table);
  POINTFLIGHT_EACH(hn::TableLookupLanes(values, hn::IndicesFromVec(kF, index.v[p])))
  return out;
}
/// The lanes whose bits are set, one after the other, then zeros. Highway's Compress does it only
/// with AVX-512: on AVX2 its release 1.0 copies a table to the stack each time.
POINTFLIGHT_INLINE U8 chosen_lanes(std::uint32_t bits) {
  U8 out;
  const hn::Rebind<std::uint8_t, FloatTag> bytes;
  const std::uint8_t* lanes = kChosenLanes.data() + 8 * std::size_t{bits};
  POINTFLIGHT_EACH(hn::BitCast(kU, hn::PromoteTo(kI, hn::LoadU(bytes, lanes + p * kWidth))))
  return out;
}
/// a[index] for indices below eight.
POINTFLIGHT_INLINE F8 permuted(const F8& a, const U8& index) {
  F8 out;
  if constexpr (kWidth < 8) {
    alignas(32) float values[8];
    store(a, values);
    return look_up_each(values, index);
  }
  POINTFLIGHT_EACH(hn::TableLookupLanes(a.v[p], hn::IndicesFromVec(kF, index.v[p])))
  return out;
}
/// Lanes in which any of the given bits is set.
POINTFLIGHT_INLINE M8 any_bit(const U8& a, std::uint32_t bits) {
  M8 out;
  const auto wanted = hn::Set(kU, bits);
  POINTFLIGHT_EACH(hn::RebindMask(kF, hn::TestBit(a.v[p], wanted)))
  return out;
}

/// Lanes i for which bit i is set: the inverse of `bits`.
POINTFLIGHT_INLINE M8 lanes_of(std::uint32_t bits) {
  alignas(32) static constexpr std::uint32_t kBit[8] = {1, 2, 4, 8, 16, 32, 64, 128};
  M8 out;
  const auto set = hn::Set(kU, bits);
  POINTFLIGHT_EACH(hn::RebindMask(kF, hn::TestBit(set, hn::Load(kU, kBit + p * kWidth))))
  return out;
}

/// Towards zero.
POINTFLIGHT_INLINE I8 to_int(const F8& a) {
  I8 out;
  POINTFLIGHT_EACH(hn::ConvertTo(kI, a.v[p]))
  return out;
}
POINTFLIGHT_INLINE I8 load_unaligned(const std::int32_t* x) {
  I8 out;
  POINTFLIGHT_EACH(hn::LoadU(kI, x + p * kWidth))
  return out;
}
/// first, first + 1, ... first + 7
POINTFLIGHT_INLINE I8 count_from(std::int32_t first) {
  I8 out;
  POINTFLIGHT_EACH(hn::Iota(kI, first + static_cast<std::int32_t>(p * kWidth)))
  return out;
}
POINTFLIGHT_INLINE U8 as_bits(const F8& a) {
  U8 out;
  POINTFLIGHT_EACH(hn::BitCast(kU, a.v[p]))
  return out;
}
POINTFLIGHT_INLINE U8 as_bits(const I8& a) {
  U8 out;
  POINTFLIGHT_EACH(hn::BitCast(kU, a.v[p]))
  return out;
}
POINTFLIGHT_INLINE I8 splat_int(std::int32_t x) {
  I8 out;
  POINTFLIGHT_EACH(hn::Set(kI, x))
  return out;
}
POINTFLIGHT_INLINE I8 load(const std::int32_t* x) {
  I8 out;
  POINTFLIGHT_EACH(hn::Load(kI, x + p * kWidth))
  return out;
}
POINTFLIGHT_INLINE void store(const I8& a, std::int32_t* x) {
  for (std::size_t p = 0; p < kParts; ++p) hn::Store(a.v[p], kI, x + p * kWidth);
}
POINTFLIGHT_INLINE I8 operator+(const I8& a, const I8& b) {
  I8 out;
  POINTFLIGHT_EACH(hn::Add(a.v[p], b.v[p]))
  return out;
}
POINTFLIGHT_INLINE I8 operator-(const I8& a, const I8& b) {
  I8 out;
  POINTFLIGHT_EACH(hn::Sub(a.v[p], b.v[p]))
  return out;
}
POINTFLIGHT_INLINE I8 operator*(const I8& a, const I8& b) {
  I8 out;
  POINTFLIGHT_EACH(hn::Mul(a.v[p], b.v[p]))
  return out;
}
template <int kBits>
POINTFLIGHT_INLINE I8 right(const I8& a) {
  I8 out;
  POINTFLIGHT_EACH(hn::ShiftRight<kBits>(a.v[p]))
  return out;
}
POINTFLIGHT_INLINE M8 operator<(const I8& a, const I8& b) {
  M8 out;
  POINTFLIGHT_EACH(hn::RebindMask(kF, hn::Lt(a.v[p], b.v[p])))
  return out;
}
POINTFLIGHT_INLINE M8 operator==(const I8& a, const I8& b) {
  M8 out;
  POINTFLIGHT_EACH(hn::RebindMask(kF, hn::Eq(a.v[p], b.v[p])))
  return out;
}
POINTFLIGHT_INLINE F8 to_float(const I8& a) {
  F8 out;
  POINTFLIGHT_EACH(hn::ConvertTo(kF, a.v[p]))
  return out;
}
/// Splits eight 64-bit words into their halves.
POINTFLIGHT_INLINE void load_words(const std::uint64_t* x, U8& low, U8& high) {
  const auto* halves = reinterpret_cast<const std::uint32_t*>(x);
  for (std::size_t p = 0; p < kParts; ++p) {
    hn::LoadInterleaved2(kU, halves + 2 * p * kWidth, low.v[p], high.v[p]);
  }
}
POINTFLIGHT_INLINE std::int32_t sum(const I8& a) {
  auto all = a.v[0];
  for (std::size_t p = 1; p < kParts; ++p) all = hn::Add(all, a.v[p]);
  return hn::GetLane(hn::SumOfLanes(kI, all));
}
POINTFLIGHT_INLINE float sum(const F8& a) {
  alignas(32) float lanes[8];
  store(a, lanes);
  // one order on every target
  return ((lanes[0] + lanes[1]) + (lanes[2] + lanes[3])) +
         ((lanes[4] + lanes[5]) + (lanes[6] + lanes[7]));
}
/// Of whole numbers whose sum a float holds exactly: in any order.
POINTFLIGHT_INLINE float sum_whole(const F8& a) {
  auto all = a.v[0];
  for (std::size_t p = 1; p < kParts; ++p) all = hn::Add(all, a.v[p]);
  return hn::GetLane(hn::SumOfLanes(kF, all));
}
POINTFLIGHT_INLINE float greatest(const F8& a) {
  auto all = a.v[0];
  for (std::size_t p = 1; p < kParts; ++p) all = hn::Max(all, a.v[p]);
  return hn::GetLane(hn::MaxOfLanes(kF, all));
}
POINTFLIGHT_INLINE float least(const F8& a) {
  auto all = a.v[0];
  for (std::size_t p = 1; p < kParts; ++p) all = hn::Min(all, a.v[p]);
  return hn::GetLane(hn::MinOfLanes(kF, all));
}
// NOLINTEND(cppcoreguidelines-pro-type-member-init)

#undef POINTFLIGHT_EACH

}  // namespace pointflight::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
