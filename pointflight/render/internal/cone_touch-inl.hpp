// Surfels that wide beams touch: each goes into the beam's list, as a quadratic over the
// cross-section: sub-rays need no way of their own.
//
// Whatever decides of a beam's result is calculated in the beam's own frame: which beams go
// together does not change a bit of it.
//
// Included once a target by Highway's foreach_target; see cone_kernel.cpp.
#if defined(POINTFLIGHT_RENDER_CONE_TOUCH_INL_HPP) == defined(HWY_TARGET_TOGGLE)
#ifdef POINTFLIGHT_RENDER_CONE_TOUCH_INL_HPP
#undef POINTFLIGHT_RENDER_CONE_TOUCH_INL_HPP
#else
#define POINTFLIGHT_RENDER_CONE_TOUCH_INL_HPP
#endif

#include "pointflight/render/internal/cone_leaf-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace pointflight::HWY_NAMESPACE {

/// Forgets the surfels behind the end of a beam.
POINTFLIGHT_INLINE void forget_behind(const ConeBundle& b, ConeBeam& beam) {
  ConeList& list = beam.list;
  std::size_t kept = 0;
  for (std::size_t i = 0; i < list.count; ++i) {
    const bool counts = 1.0f <= surfel_at(b, list, i).nearest() * beam.numbers[kDeepest];
    list.at[kept] = list.at[i];
    kept += counts ? 1 : 0;
  }
  list.count = kept;
}

/// Weights, depths and cosines are whole numbers of these, so that their sums, which floats hold
/// exactly, do not depend on the order of adding.
///@{
inline constexpr float kWeightSteps = 1024.0f;
inline constexpr float kDepthSteps = 512.0f;  ///< Of the window.
inline constexpr float kCosineSteps = 512.0f;
///@}

/// `x`, 0 to 2^22, as a whole number.
POINTFLIGHT_INLINE F8 rounded(const F8& x) {
  const F8 large = splat(12582912.0f);  // 1.5 * 2^23: floats there are whole numbers
  return (x + large) - large;
}

/// Weights of surfels at m^2 from a ray, 1 where a covered plane is whole on average.
POINTFLIGHT_INLINE F8 soft_weights_of(const KernelMap& map, const F8& m2) {
  const F8 share = splat(1.0f) - m2 * splat(map.inverse_support);
  const F8 steps = splat(map.weight_scale * kWeightSteps / kWeightOne);
  return rounded(steps * share * share);
}

/// Of a surfel's support, so much counts as the surfel where none of a few sub-rays hits it: with
/// all of it every edge's fringe would be in the way, with half of it shares of wires are missed
/// (footprint_test).
inline constexpr float kSolidShare = 0.62f;

/// Notes the surfels of `lanes` that a beam may touch.
POINTFLIGHT_INLINE void add_pairs(const ConeBeam& beam,
                                  const SeenLeaf& seen,
                                  std::uint32_t lanes,
                                  ConePairs& pairs) {
  const U8 chosen = chosen_lanes(lanes);
  const std::size_t at = pairs.count;
  store_unaligned(permuted(seen.u, chosen), pairs.u + at);
  store_unaligned(permuted(seen.v, chosen), pairs.v + at);
  store_unaligned(permuted(seen.depth, chosen), pairs.depth + at);
  store_unaligned(as_float(chosen), pairs.lane + at);
  // to the lanes behind, too: the next beam's are written over them
  for (std::size_t k = 0; k < kBeamNumbers; ++k) {
    store_unaligned(splat(beam.numbers[k]), pairs.beam[k] + at);
  }
  pairs.count = at + static_cast<std::size_t>(std::popcount(lanes));
}

/// Eight pairs from `at` on, whose beams look along the same axis as `axes`, into a block.
///
/// Along the beam, a surfel of covariance S is an ellipse P over (u, v), which the axis passes at
/// -(du, dv) from its centre: m^2 = (du, dv) P^-1 (du, dv), and its depth there is the conditional
/// mean of w (EWA splatting: Zwicker et al., 2001, with a frame that shears instead of turning).
POINTFLIGHT_INLINE void touch_eight(const KernelMap& map,
                                    const ConeLeaf& leaf,
                                    const ConeBeam& axes,
                                    std::size_t at,
                                    ConeBundle& b) {
  ConePairs& pairs = b.pairs;
  const auto number = [&](BeamNumber which) { return load(pairs.beam[which] + at); };
  const U8 lane = as_bits(load(pairs.lane + at)) & splat_bits(7u);  // behind the last is anything
  const auto covariance = [&](int k, int m) { return look_up8(leaf.covariance[k][m], lane); };
  const auto normal = [&](int k) { return look_up8(leaf.normal[k], lane); };
  const F8 zero = splat(0.0f);
  const F8 one = splat(1.0f);
  const F8 forward = splat(axes.forward);
  const F8 at_u = number(kAtU);
  const F8 at_v = number(kAtV);
  const F8 seen_u = load(pairs.u + at);
  const F8 seen_v = load(pairs.v + at);
  const F8 seen_depth = load(pairs.depth + at);
  const F8 ww = covariance(axes.w, axes.w);
  const F8 uw = covariance(axes.u, axes.w) * forward;
  const F8 vw = covariance(axes.v, axes.w) * forward;
  const F8 p = uw - at_u * ww;  // of w with u and v, along the beam
  const F8 q = vw - at_v * ww;
  const F8 uu = covariance(axes.u, axes.u) - at_u * (uw + p);
  const F8 vv = covariance(axes.v, axes.v) - at_v * (vw + q);
  const F8 uv = covariance(axes.u, axes.v) - at_u * vw - at_v * p;
  const F8 per_det = one / (uu * vv - uv * uv);
  const F8 iuu = vv * per_det;
  const F8 iuv = zero - uv * per_det;
  const F8 ivv = uu * per_det;
  const F8 hu = iuu * seen_u + iuv * seen_v;
  const F8 hv = iuv * seen_u + ivv * seen_v;
  const F8 m2 = seen_u * hu + seen_v * hv;
  const F8 depth = seen_depth - (p * hu + q * hv);
  const F8 inverse = one / depth;
  const F8 inverse_u = zero - (p * iuu + q * iuv) * inverse;
  const F8 inverse_v = zero - (p * iuv + q * ivv) * inverse;
  // the nearest that a ray within the radius may pass: by the longer half axis of one sigma of the
  // beam, in the surfel's deviations
  const F8 zz = seen_depth * seen_depth;
  const F8 mean = zz * (iuu * number(kHalfUU) + iuv * number(kUV) + ivv * number(kHalfVV));
  const F8 product = zz * zz * per_det * number(kDet);
  const F8 longer = sqrt(mean + sqrt(max(zero, mean * mean - product)));
  const F8 room = splat(kConeRadius) * longer;
  const F8 limit = splat(map.support) + room;
  // in the beam, and within the surfel's box: its plane goes on outside, where a way may have ended
  const F8 in_beam = inverse + number(kWideU) * abs(inverse_u) + number(kWideV) * abs(inverse_v);
  const F8 begin = seen_depth - look_up8(leaf.reach[axes.w], lane);
  const F8 nearest = min(in_beam, one / max(begin, splat(1e-6f)));
  const std::uint32_t there = pairs.count - at >= 8 ? 0xffu : (1u << (pairs.count - at)) - 1u;
  const M8 touched = (m2 < limit * limit) & (one <= nearest * number(kDeepest)) & lanes_of(there);
  // no branch: what touches nothing is written over by the next
  ConeBlock& block = b.pool[b.used];
  const F8 twice = zero - (seen_depth + seen_depth);
  store(m2, block.m2[0]);
  store(twice * hu, block.m2[1]);
  store(twice * hv, block.m2[2]);
  store(zz * iuu, block.m2[3]);
  store(zz * (iuv + iuv), block.m2[4]);
  store(zz * ivv, block.m2[5]);
  store(inverse, block.inverse[0]);
  store(inverse_u, block.inverse[1]);
  store(inverse_v, block.inverse[2]);
  const F8 cosine = (normal(axes.u) * at_u + normal(axes.v) * at_v + normal(axes.w) * forward) *
                    number(kPerLength);
  store(rounded(abs(cosine) * splat(kCosineSteps)), block.cosine);
  store(nearest, block.nearest);
  const F8 solid = splat(kSolidShare * map.support) + room;
  store(select(m2 < solid * solid, one, zero), block.solid);
  store(as_float(lane + splat_bits(leaf.first_word)), block.word);
  const auto first = static_cast<std::int32_t>(b.used * kBlockFloats);
  store(as_float(as_bits(count_from(first))), pairs.address + at);
  const M8 on_axis = touched & (m2 < splat(map.support_squared));
  store(select(on_axis, soft_weights_of(map, m2), zero), pairs.weight + at);
  store(select(touched, depth, zero), pairs.reached + at);
  const std::uint32_t which = bits(touched);
  pairs.touched[at / 8] = static_cast<std::uint8_t>(which);
  b.used += which != 0 ? 1 : 0;
}

/// Those of a beam's pairs, `count` of them from `at` on, that it touches, into its list, which has
/// room. To its cover, too.
POINTFLIGHT_INLINE void take_touched(const ConePairs& pairs,
                                     std::size_t at,
                                     std::size_t count,
                                     ConeBeam& beam) {
  const auto two = static_cast<std::uint32_t>(pairs.touched[at / 8]) |
                   static_cast<std::uint32_t>(pairs.touched[at / 8 + 1]) << 8;
  const std::uint32_t which = (two >> (at % 8)) & ((1u << count) - 1u);
  const M8 mine = lanes_of(which);
  ConeList& list = beam.list;
  store_unaligned(permuted(load_unaligned(pairs.address + at), chosen_lanes(which)),
                  list.at + list.count);
  list.count += static_cast<std::size_t>(std::popcount(which));
  const F8 zero = splat(0.0f);
  beam.cover += sum_whole(select(mine, load_unaligned(pairs.weight + at), zero));
  const float reached = greatest(select(mine, load_unaligned(pairs.reached + at), zero));
  beam.far = std::max(beam.far, reached);
}

}  // namespace pointflight::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
