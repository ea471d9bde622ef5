// The surfels of a leaf as wide beams see them, and which of them a beam may touch.
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
struct ConeLeaf {                  // NOLINT(cppcoreguidelines-pro-type-member-init): all is written
  alignas(32) float center[3][8];  ///< From the leaf's origin, m.
  alignas(32) float covariance[3][3][8];  ///< m^2
  alignas(32) float reach[3][8];          ///< Of the supports, m.
  alignas(32) float normal[3][8];         ///< e0
  std::uint32_t corner[3];                ///< Voxel of the leaf's origin.
  std::uint32_t first_word, lanes;
};

POINTFLIGHT_INLINE ConeLeaf cone_leaf(const KernelMap& map, const Entry& entry) {
  ConeLeaf leaf;  // NOLINT(cppcoreguidelines-pro-type-member-init): all is written
  const LeafHeader header = decode_leaf(map.words[entry.index]);
  leaf.first_word = entry.index + 1;
  leaf.lanes = (1u << entry.meta) - 1u;
  leaf.corner[0] = header.x;
  leaf.corner[1] = header.y;
  leaf.corner[2] = header.z;
  const SurfelLanes surfels = load_surfels(map.scale, map.words + entry.index + 1);
  store(surfels.x, leaf.center[0]);
  store(surfels.y, leaf.center[1]);
  store(surfels.z, leaf.center[2]);
  const Shapes e = decode_shapes(map.scale, surfels);
  const Variances variances = variances_of(map.scale, surfels, e);
  // the rows of whitening, by deviations times their squares: axes as long as the deviations
  const F8 axes[3][3] = {{e.m0x * variances.x, e.m0y * variances.x, e.m0z * variances.x},
                         {e.m1x * variances.y, e.m1y * variances.y, e.m1z * variances.y},
                         {e.m2x * variances.z, e.m2y * variances.z, e.m2z * variances.z}};
  for (int k = 0; k < 3; ++k) {
    for (int m = k; m < 3; ++m) {
      const F8 both = axes[0][k] * axes[0][m] + axes[1][k] * axes[1][m] + axes[2][k] * axes[2][m];
      store(both, leaf.covariance[k][m]);
      store(both, leaf.covariance[m][k]);
      if (m == k) store(sqrt(both) * splat(1.01f * map.support), leaf.reach[k]);
    }
  }
  store(e.m0x * e.s0, leaf.normal[0]);
  store(e.m0y * e.s0, leaf.normal[1]);
  store(e.m0z * e.s0, leaf.normal[2]);
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
  const auto along = [&](int axis) { return load(leaf.center[axis]) + splat(corner[axis]); };
  SeenLeaf seen;  // NOLINT(cppcoreguidelines-pro-type-member-init): all is written
  seen.depth = along(beam.w) * splat(beam.forward);
  seen.u = along(beam.u) - splat(beam.numbers[kAtU]) * seen.depth;
  seen.v = along(beam.v) - splat(beam.numbers[kAtV]) * seen.depth;
  return seen;
}

/// Which of them it may touch: a bit each.
POINTFLIGHT_INLINE std::uint32_t may_touch(const ConeLeaf& leaf,
                                           const ConeBeam& beam,
                                           const SeenLeaf& seen) {
  const F8 deep = load(leaf.reach[beam.w]);
  const F8 farthest = seen.depth + deep;
  const auto beside = [&](int axis, float at, float wide) {
    return load(leaf.reach[axis]) + splat(std::abs(at)) * deep + splat(wide) * farthest;
  };
  return bits((abs(seen.u) <= beside(beam.u, beam.numbers[kAtU], beam.numbers[kWideU])) &
              (abs(seen.v) <= beside(beam.v, beam.numbers[kAtV], beam.numbers[kWideV]))) &
         leaf.lanes;
}

}  // namespace pointflight::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
