// Packets: up to 64 beams that lie so close together that most surfels which one of them hits are
// hit by its neighbours too. `test_node` holds the eight children of a node against the frustum's
// four planes, and bounds their distance along the axis w is closest to. What passes is held
// against the groups' own rectangles in (u, v) (packet_leaf-inl.hpp), and its surfels against eight
// beams at once (beam_packets-inl.hpp).
//
// Included once a target by Highway's foreach_target; see beam_kernel.cpp.
#if defined(POINTFLIGHT_RENDER_PACKET_INL_HPP) == defined(HWY_TARGET_TOGGLE)
#ifdef POINTFLIGHT_RENDER_PACKET_INL_HPP
#undef POINTFLIGHT_RENDER_PACKET_INL_HPP
#else
#define POINTFLIGHT_RENDER_PACKET_INL_HPP
#endif

#include "pointflight/render/internal/beam_groups-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace pointflight::HWY_NAMESPACE {

/// Rows of hits of one group: beyond, its beams are traced singly.
inline constexpr std::size_t kRows = 96;

/// Hits of eight beams: a row is one surfel, lanes that it does not hit hold kNever and weight 0.
struct HitRows {
  std::size_t count;
  alignas(32) float t[kRows][8];
  alignas(32) std::int32_t weight[kRows][8];
  alignas(32) float cosine[kRows][8];
  std::uint32_t word[kRows];
};

struct Packet : BeamGroups {
  std::uint32_t failed;  ///< Groups to be traced singly.
  HitRows rows[kGroups];
};

/// Sets up a packet of the first `count` groups.
POINTFLIGHT_INLINE void set_up_packet(const KernelMap& map, Packet& p, std::size_t count) {
  set_up(map, p, count);
  p.failed = 0;
  for (std::size_t g = 0; g < count; ++g) p.rows[g].count = 0;
}

/// Which children the frustum may touch, and a lower bound of the distance to each.
POINTFLIGHT_INLINE std::uint32_t test_node(const Packet& p,
                                           const Bvh8Node& node,
                                           float* distances) {
  // lo x, y, z, hi x, y, z of the children, metres from the node's corner
  alignas(32) float sides[6][8];
  const F8 scale = splat(node.scale);
  for (int k = 0; k < 3; ++k) {
    store(load_bytes(node.lo[k]) * scale, sides[k]);
    store(load_bytes(node.hi[k]) * scale, sides[k + 3]);
  }
  float corner[3];
  for (int axis = 0; axis < 3; ++axis) corner[axis] = node.origin[axis] - p.apex_box[axis];
  const F8 distance = max(
      splat(0.0f),
      (splat(corner[p.main_axis] - p.main_offset) + load(sides[p.main_side])) * splat(p.main_step));
  store(distance, distances);
  F8 inside = splat(p.end) - distance;
  for (int k = 0; k < 4; ++k) {
    const float* n = p.plane[k];
    const std::uint32_t* side = p.plane_side[k];
    const F8 depth = splat(n[0]) * (splat(corner[0]) + load(sides[side[0]])) +
                     splat(n[1]) * (splat(corner[1]) + load(sides[side[1]])) +
                     splat(n[2]) * (splat(corner[2]) + load(sides[side[2]]));
    inside = min(inside, depth - splat(p.offset[k]));
  }
  return bits(splat(-1e-4f * node.scale) <= inside);
}

}  // namespace pointflight::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
