// The surfels of a leaf as wide beams see them: each that a beam's cross-section touches goes into
// the beam's list, as a quadratic over the cross-section: sub-rays need no way of their own.
//
// Whatever decides of a beam's result is calculated in the beam's own frame: which beams go
// together does not change a bit of it.
//
// Included once a target by Highway's foreach_target; see cone_kernel.cpp.
#if defined(POINTFLIGHT_RENDER_CONE_LEAF_INL_HPP) == defined(HWY_TARGET_TOGGLE)
#ifdef POINTFLIGHT_RENDER_CONE_LEAF_INL_HPP
#undef POINTFLIGHT_RENDER_CONE_LEAF_INL_HPP
#else
#define POINTFLIGHT_RENDER_CONE_LEAF_INL_HPP
#endif

#include "pointflight/render/internal/cone_list-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace pointflight::HWY_NAMESPACE {

/// A leaf's surfels as all beams share them, by the map's axes.
struct ConeLeaf {       // NOLINT(cppcoreguidelines-pro-type-member-init): all is written
  F8 center[3];         ///< From the leaf's origin, m.
  F8 covariance[3][3];  ///< m^2
  F8 reach[3];          ///< Of the supports, m.
  F8 normal[3];         ///< e0
  double corner[3];     ///< The leaf's origin from the map's, m.
  std::uint32_t first_word, lanes;
};

POINTFLIGHT_INLINE ConeLeaf cone_leaf(const KernelMap& map, const Entry& entry) {
  ConeLeaf leaf;  // NOLINT(cppcoreguidelines-pro-type-member-init): all is written
  const LeafHeader header = decode_leaf(map.words[entry.index]);
  leaf.first_word = entry.index + 1;
  leaf.lanes = (1u << entry.meta) - 1u;
  leaf.corner[0] = header.x * map.resolution;
  leaf.corner[1] = header.y * map.resolution;
  leaf.corner[2] = header.z * map.resolution;
  const SurfelLanes surfels = load_surfels(map.scale, map.words + entry.index + 1);
  leaf.center[0] = surfels.x;
  leaf.center[1] = surfels.y;
  leaf.center[2] = surfels.z;
  const Shapes e = decode_shapes(map.scale, surfels);
  const Variances variances = variances_of(map.scale, surfels, e);
  // the rows of whitening, by deviations times their squares: axes as long as the deviations
  const F8 axes[3][3] = {{e.m0x * variances.x, e.m0y * variances.x, e.m0z * variances.x},
                         {e.m1x * variances.y, e.m1y * variances.y, e.m1z * variances.y},
                         {e.m2x * variances.z, e.m2y * variances.z, e.m2z * variances.z}};
  for (int k = 0; k < 3; ++k) {
    for (int m = k; m < 3; ++m) {
      leaf.covariance[k][m] =
          axes[0][k] * axes[0][m] + axes[1][k] * axes[1][m] + axes[2][k] * axes[2][m];
      leaf.covariance[m][k] = leaf.covariance[k][m];
    }
    leaf.reach[k] = sqrt(leaf.covariance[k][k]) * splat(1.01f * map.support);
  }
  leaf.normal[0] = e.m0x * e.s0;
  leaf.normal[1] = e.m0y * e.s0;
  leaf.normal[2] = e.m0z * e.s0;
  return leaf;
}

/// Where a beam sees the surfels of a leaf: u and v of the centres from its axis, and their depth,
/// m.
struct SeenLeaf {  // NOLINT(cppcoreguidelines-pro-type-member-init): all is written
  F8 u, v, depth;
};

POINTFLIGHT_INLINE SeenLeaf see(const ConeLeaf& leaf,
                                const ConeBeam& beam,
                                const float (&corner)[3]) {
  const auto along = [&](int axis) { return leaf.center[axis] + splat(corner[axis]); };
  SeenLeaf seen;  // NOLINT(cppcoreguidelines-pro-type-member-init): all is written
  seen.depth = along(beam.w) * splat(beam.forward);
  seen.u = along(beam.u) - splat(beam.at_u) * seen.depth;
  seen.v = along(beam.v) - splat(beam.at_v) * seen.depth;
  return seen;
}

/// Which of them it may touch: a bit each.
POINTFLIGHT_INLINE std::uint32_t may_touch(const ConeLeaf& leaf,
                                           const ConeBeam& beam,
                                           const SeenLeaf& seen) {
  const F8 deep = leaf.reach[beam.w];
  const F8 farthest = seen.depth + deep;
  const auto beside = [&](int axis, float at, float wide) {
    return leaf.reach[axis] + splat(std::abs(at)) * deep + splat(wide) * farthest;
  };
  return bits((abs(seen.u) <= beside(beam.u, beam.at_u, beam.wide_u)) &
              (abs(seen.v) <= beside(beam.v, beam.at_v, beam.wide_v))) &
         leaf.lanes;
}

/// Forgets the surfels behind the end of a beam.
POINTFLIGHT_INLINE void forget_behind(const ConeBundle& b, ConeBeam& beam) {
  ConeList& list = beam.list;
  std::size_t kept = 0;
  for (std::size_t i = 0; i < list.count; ++i) {
    const bool counts = beam.length <= surfel_at(b, list, i).nearest() * beam.end;
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

/// The surfels of `lanes` that a beam touches, into its list, which has room. To its cover, too.
///
/// Along the beam, a surfel of covariance S is an ellipse P over (u, v), which the axis passes at
/// -(du, dv) from its centre: m^2 = (du, dv) P^-1 (du, dv), and its depth there is the conditional
/// mean of w (EWA splatting: Zwicker et al., 2001, with a frame that shears instead of turning).
POINTFLIGHT_INLINE void touch(const KernelMap& map,
                              const ConeLeaf& leaf,
                              const SeenLeaf& seen,
                              std::uint32_t lanes,
                              ConeBundle& b,
                              ConeBeam& beam) {
  const F8 zero = splat(0.0f);
  const F8 one = splat(1.0f);
  const F8 half = splat(0.5f);
  const F8 at_u = splat(beam.at_u);
  const F8 at_v = splat(beam.at_v);
  const F8 forward = splat(beam.forward);
  const F8 ww = leaf.covariance[beam.w][beam.w];
  const F8 uw = leaf.covariance[beam.u][beam.w] * forward;
  const F8 vw = leaf.covariance[beam.v][beam.w] * forward;
  const F8 p = uw - at_u * ww;  // of w with u and v, along the beam
  const F8 q = vw - at_v * ww;
  const F8 uu = leaf.covariance[beam.u][beam.u] - at_u * (uw + p);
  const F8 vv = leaf.covariance[beam.v][beam.v] - at_v * (vw + q);
  const F8 uv = leaf.covariance[beam.u][beam.v] - at_u * vw - at_v * p;
  const F8 per_det = one / (uu * vv - uv * uv);
  const F8 iuu = vv * per_det;
  const F8 iuv = zero - uv * per_det;
  const F8 ivv = uu * per_det;
  const F8 hu = iuu * seen.u + iuv * seen.v;
  const F8 hv = iuv * seen.u + ivv * seen.v;
  const F8 m2 = seen.u * hu + seen.v * hv;
  const F8 depth = seen.depth - (p * hu + q * hv);
  const F8 inverse = one / depth;
  const F8 inverse_u = zero - (p * iuu + q * iuv) * inverse;
  const F8 inverse_v = zero - (p * iuv + q * ivv) * inverse;
  // the nearest that a ray within the radius may pass: by the longer half axis of one sigma of the
  // beam, in the surfel's deviations
  const F8 zz = seen.depth * seen.depth;
  const F8 mean =
      half * zz * (iuu * splat(beam.uu) + (iuv + iuv) * splat(beam.uv) + ivv * splat(beam.vv));
  const F8 product = zz * zz * per_det * splat(beam.det);
  const F8 longer = sqrt(mean + sqrt(max(zero, mean * mean - product)));
  const F8 room = splat(kConeRadius) * longer;
  const F8 limit = splat(map.support) + room;
  const F8 nearest =
      inverse + splat(beam.wide_u) * abs(inverse_u) + splat(beam.wide_v) * abs(inverse_v);
  const M8 touched =
      (m2 < limit * limit) & (splat(beam.length) <= nearest * splat(beam.end)) & lanes_of(lanes);
  // no branch: what touches nothing is written over by the next
  ConeBlock& block = b.pool[b.used];
  const F8 twice = zero - (seen.depth + seen.depth);
  store(m2, block.m2[0]);
  store(twice * hu, block.m2[1]);
  store(twice * hv, block.m2[2]);
  store(zz * iuu, block.m2[3]);
  store(zz * (iuv + iuv), block.m2[4]);
  store(zz * ivv, block.m2[5]);
  store(inverse, block.inverse[0]);
  store(inverse_u, block.inverse[1]);
  store(inverse_v, block.inverse[2]);
  const F8 cosine = leaf.normal[beam.u] * splat(beam.direction[0]) +
                    leaf.normal[beam.v] * splat(beam.direction[1]) +
                    leaf.normal[beam.w] * splat(beam.forward * beam.direction[2]);
  store(rounded(abs(cosine) * splat(kCosineSteps)), block.cosine);
  store(nearest, block.nearest);
  const F8 solid = splat(kSolidShare * map.support) + room;
  store(select(m2 < solid * solid, one, zero), block.solid);
  store(as_float(as_bits(count_from(static_cast<std::int32_t>(leaf.first_word)))), block.word);
  ConeList& list = beam.list;
  const auto first = static_cast<std::int32_t>(b.used * kBlockFloats);
  store_chosen(as_float(as_bits(count_from(first))), touched, list.at + list.count);
  const std::uint32_t which = bits(touched);
  list.count += static_cast<std::size_t>(std::popcount(which));
  b.used += which != 0 ? 1 : 0;
  const M8 on_axis = touched & (m2 < splat(map.support_squared));
  beam.cover += sum(select(on_axis, soft_weights_of(map, m2), zero));
  beam.far = std::max(beam.far, greatest(select(touched, depth, zero)) * beam.length);
}

}  // namespace pointflight::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
