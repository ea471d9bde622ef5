// A leaf's surfels as a packet of beams sees them: which groups may hit which surfels.
//
// Included once a target by Highway's foreach_target; see beam_kernel.cpp.
#if defined(POINTFLIGHT_RENDER_PACKET_LEAF_INL_HPP) == defined(HWY_TARGET_TOGGLE)
#ifdef POINTFLIGHT_RENDER_PACKET_LEAF_INL_HPP
#undef POINTFLIGHT_RENDER_PACKET_LEAF_INL_HPP
#else
#define POINTFLIGHT_RENDER_PACKET_LEAF_INL_HPP
#endif

#include "pointflight/render/internal/packet-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace pointflight::HWY_NAMESPACE {

/// What the groups need of a leaf's surfels.
// NOLINTNEXTLINE(cppcoreguidelines-pro-type-member-init): written before it is read
struct PacketLeaf {
  SurfelLanes lanes;
  std::uint32_t corner[3];  ///< Voxel of the leaf's origin.
  std::uint32_t first_word;
  std::uint32_t count;
  // one value per surfel
  alignas(32) float shape[10][8];
  alignas(32) float center[3][8];    ///< From the leaf's origin, m.
  alignas(32) float whitened[3][8];  ///< From the apex: what all beams share if origins agree.
};

/// Of eight surfels' centres, from the apex.
struct Place {
  F8 x, y, z;
};

/// The centres of a leaf's surfels in the packet's frame, and which of them the packet may hit.
struct InFrustum {  // NOLINT(cppcoreguidelines-pro-type-member-init): all is written
  F8 u, v, depth;   ///< From the apex, m.
  std::uint32_t surfels = 0;
};

POINTFLIGHT_INLINE InFrustum in_frustum(const KernelMap& map,
                                        const Packet& p,
                                        const PacketLeaf& leaf,
                                        const Place& center) {
  const auto along = [&](const float* axis) {
    return center.x * splat(axis[0]) + center.y * splat(axis[1]) + center.z * splat(axis[2]);
  };
  InFrustum in;  // NOLINT(cppcoreguidelines-pro-type-member-init): all is written
  in.u = along(p.u);
  in.v = along(p.v);
  in.depth = along(p.w);
  const F8 reach =
      (sqrt(leaf.lanes.widest * splat(map.support_squared)) * splat(1.03f) + splat(p.spread)) *
      splat(p.norm);
  const F8 inside = min(min(in.u - in.depth * splat(p.low_u), in.depth * splat(p.high_u) - in.u),
                        min(in.v - in.depth * splat(p.low_v), in.depth * splat(p.high_v) - in.v));
  const M8 met = (splat(0.0f) <= inside + reach) & (in.depth <= splat(p.end) + reach) &
                 (splat(0.0f) <= in.depth + reach);
  in.surfels = bits(met) & ((1u << leaf.count) - 1u);
  return in;
}

/// Which surfels of a leaf each group may hit: bit i of byte g. A surfel's support is an
/// ellipsoid; seen from the apex it lies within a rectangle of the plane across the packet's mean
/// direction: with its centre at c_u = (c.u) / (c.w), a point c + e of it lies (e.(u - c_u w)) /
/// ((c + e).w) beside, and e.n is M |S R n| at most.
POINTFLIGHT_INLINE std::uint64_t pairs_of(const KernelMap& map,
                                          const Packet& p,
                                          const PacketLeaf& leaf,
                                          const Shapes& e,
                                          const InFrustum& in) {
  const SurfelLanes& s = leaf.lanes;
  const Whitened eu = whiten(e, splat(p.u[0]), splat(p.u[1]), splat(p.u[2]));
  const Whitened ev = whiten(e, splat(p.v[0]), splat(p.v[1]), splat(p.v[2]));
  const Whitened ew = whiten(e, splat(p.w[0]), splat(p.w[1]), splat(p.w[2]));
  const Variances variances = variances_of(map.scale, s, e);
  const auto reach_along = [&](const F8& x, const F8& y, const F8& z) {
    return pointflight::HWY_NAMESPACE::reach_along(map, variances, {x, y, z});
  };
  const F8 per_depth = splat(1.0f) / in.depth;
  const F8 at_u = in.u * per_depth;
  const F8 at_v = in.v * per_depth;
  const F8 spread = splat(p.spread);
  const F8 reach_w = reach_along(ew.x, ew.y, ew.z) + spread;
  const F8 reach_u = reach_along(eu.x - at_u * ew.x, eu.y - at_u * ew.y, eu.z - at_u * ew.z) +
                     spread * (splat(1.0f) + abs(at_u));
  const F8 reach_v = reach_along(ev.x - at_v * ew.x, ev.y - at_v * ew.y, ev.z - at_v * ew.z) +
                     spread * (splat(1.0f) + abs(at_v));
  const F8 begin = in.depth - reach_w;
  // around the apex a surfel may be hit in any direction
  const M8 ahead = splat(0.0f) < begin;
  const F8 per_begin = splat(1.0f) / begin;
  const F8 everywhere = splat(1e30f);
  const F8 half_u = select(ahead, reach_u * per_begin, everywhere);
  const F8 half_v = select(ahead, reach_v * per_begin, everywhere);
  const F8 middle_u = select(ahead, at_u, splat(0.0f));
  const F8 middle_v = select(ahead, at_v, splat(0.0f));
  std::uint64_t pairs = 0;
  for (std::size_t g = 0; g < kGroups; ++g) {
    const M8 met = (abs(middle_u - splat(p.middle_u[g])) <= half_u + splat(p.half_u[g])) &
                   (abs(middle_v - splat(p.middle_v[g])) <= half_v + splat(p.half_v[g])) &
                   (begin <= splat(p.group_end[g]));
    pairs |= static_cast<std::uint64_t>(bits(met) & in.surfels) << (8 * g);
  }
  return pairs;
}

POINTFLIGHT_INLINE Shapes shape_at(const PacketLeaf& leaf, std::size_t i) {
  const auto& s = leaf.shape;
  return {splat(s[0][i]),
          splat(s[1][i]),
          splat(s[2][i]),
          splat(s[3][i]),
          splat(s[4][i]),
          splat(s[5][i]),
          splat(s[6][i]),
          splat(s[7][i]),
          splat(s[8][i]),
          splat(s[9][i])};
}

}  // namespace pointflight::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
