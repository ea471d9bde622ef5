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

/// Where groups fill less of the frustum, a look at each of them pays: in forest, hall and garage.
inline constexpr float kSparse = 0.2f;

struct Packet : BeamGroups {
  std::uint32_t failed;  ///< Groups to be traced singly.
  HitRows rows[kGroups];
  bool is_sparse;                         ///< Most of the frustum is empty: `touched_by_groups`.
  bool of_sub_rays;                       ///< Each group is one beam's: what follows is kept.
  alignas(32) float nearest[kGroups][8];  ///< `note_nearest`, in lanes of surfels.
  float shift[kGroups][3];                ///< Of a group's origin from the apex along u, v, w, m.
};

/// Sets up a packet of the first `count` groups.
POINTFLIGHT_INLINE void set_up_packet(Packet& p, std::size_t count, bool of_sub_rays) {
  set_up(p, count);
  p.failed = 0;
  p.of_sub_rays = of_sub_rays;
  p.is_sparse = false;
  for (std::size_t g = 0; g < count; ++g) p.rows[g].count = 0;
  if (!of_sub_rays) return;
  float filled = 0.0f;
  for (std::size_t g = 0; g < count; ++g) {
    store(splat(kNever), p.nearest[g]);
    const Vector3f from(static_cast<float>(p.groups[g].origin[0][0] - p.apex[0]),
                        static_cast<float>(p.groups[g].origin[1][0] - p.apex[1]),
                        static_cast<float>(p.groups[g].origin[2][0] - p.apex[2]));
    p.shift[g][0] = from.x() * p.u[0] + from.y() * p.u[1] + from.z() * p.u[2];
    p.shift[g][1] = from.x() * p.v[0] + from.y() * p.v[1] + from.z() * p.v[2];
    p.shift[g][2] = from.x() * p.w[0] + from.y() * p.w[1] + from.z() * p.w[2];
    filled += 4.0f * p.half_u[g] * p.half_v[g];
  }
  p.is_sparse = !p.one_origin || filled < kSparse * (p.high_u - p.low_u) * (p.high_v - p.low_v);
}

/// Which of a node's children any group's own rectangle touches. Beams of sub-rays are narrow and
/// may lie far apart: most of the frustum around them is empty.
POINTFLIGHT_INLINE std::uint32_t touched_by_groups(const Packet& p,
                                                   const float (&corner)[3],
                                                   const float (&sides)[6][8]) {
  F8 middle[3];
  F8 half[3];
  for (int k = 0; k < 3; ++k) {
    const F8 low = load(sides[k]);
    const F8 high = load(sides[k + 3]);
    middle[k] = splat(corner[k]) + (low + high) * splat(0.5f);
    half[k] = (high - low) * splat(0.5f);
  }
  const auto along = [&](const float* axis) {
    return middle[0] * splat(axis[0]) + middle[1] * splat(axis[1]) + middle[2] * splat(axis[2]);
  };
  const auto reach = [&](const float* axis) {
    return half[0] * splat(std::abs(axis[0])) + half[1] * splat(std::abs(axis[1])) +
           half[2] * splat(std::abs(axis[2]));
  };
  const F8 u = along(p.u);
  const F8 v = along(p.v);
  const F8 w = along(p.w);
  const F8 reach_u = reach(p.u) + splat(1e-3f);  // m, for rounding
  const F8 reach_v = reach(p.v) + splat(1e-3f);
  const F8 reach_w = reach(p.w);
  std::uint32_t touched = 0;
  for (std::size_t g = 0; g < p.count; ++g) {
    const F8 depth = w - splat(p.shift[g][2]);
    const F8 far = depth + reach_w;
    const F8 beside_u = abs(u - splat(p.shift[g][0]) - splat(p.middle_u[g]) * depth);
    const F8 beside_v = abs(v - splat(p.shift[g][1]) - splat(p.middle_v[g]) * depth);
    touched |= bits((beside_u <= reach_u + splat(std::abs(p.middle_u[g])) * reach_w +
                                     splat(p.half_u[g]) * far) &
                    (beside_v <= reach_v + splat(std::abs(p.middle_v[g])) * reach_w +
                                     splat(p.half_v[g]) * far));
  }
  return touched;
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
  const std::uint32_t entered = bits(splat(-1e-4f * node.scale) <= inside);
  return p.is_sparse && entered != 0 ? entered & touched_by_groups(p, corner, sides) : entered;
}

}  // namespace pointflight::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
