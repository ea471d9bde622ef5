// The beam kernel for one instruction set: single rays, several of them in flight at once.
//
// Included once a target by Highway's foreach_target; see beam_kernel.cpp.
#if defined(POINTFLIGHT_RENDER_BEAM_KERNEL_INL_HPP) == defined(HWY_TARGET_TOGGLE)
#ifdef POINTFLIGHT_RENDER_BEAM_KERNEL_INL_HPP
#undef POINTFLIGHT_RENDER_BEAM_KERNEL_INL_HPP
#else
#define POINTFLIGHT_RENDER_BEAM_KERNEL_INL_HPP
#endif

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <memory>

#include "pointflight/map/internal/children-inl.hpp"
#include "pointflight/render/internal/hit_rule-inl.hpp"
#include "pointflight/render/internal/map_ray.hpp"

HWY_BEFORE_NAMESPACE();
namespace pointflight::HWY_NAMESPACE {

/// Rays that one thread follows at the same time: while one waits for its node, others compute.
inline constexpr std::size_t kInFlight = 16;

/// Visits after which a way is given up: more than children, so a cycle, a corrupt file.
POINTFLIGHT_INLINE std::size_t most_steps(const KernelMap& map) {
  return map.node_count * 8 + 8;
}

/// What one beam has hit on its way, and where the way ends.
struct BeamState {
  float end;    ///< Nothing beyond matters.
  float first;  ///< Where the surface begins, kNever before one is found.
  HitLanes hits;
};

/// One beam on its way through the tree.
struct RayState : BeamState {
  alignas(32) float enter[8];    ///< Where it enters the children of the present node.
  alignas(16) float start[4];    ///< Origin from the map's origin, for boxes.
  alignas(16) float inverse[4];  ///< 1 / direction.
  float direction[3];
  std::uint32_t near_side[3];  ///< Byte of the node at which the nearer planes begin, a axis.
  std::uint32_t far_side[3];
  GridOrigin origin[3];
  std::uint32_t ray;
  const Bvh8Node* node;
  std::size_t steps;  ///< That are left.
  std::size_t depth;
  Entry stack[kStack];
};

POINTFLIGHT_INLINE void start_beam(float range_max, BeamState& s) {
  s.end = range_max;
  s.first = kNever;
  s.hits.count = 0;
  s.hits.total = 0;
  s.hits.nearest = kNever;
}

POINTFLIGHT_INLINE void start_ray(const KernelMap& map,
                                  const MapRay& ray,
                                  std::uint32_t index,
                                  RayState& s) {
  s.start[3] = 0.0f;
  s.inverse[3] = 0.0f;
  s.ray = index;
  start_beam(ray.range_max, s);
  s.node = map.nodes;
  s.steps = most_steps(map);
  s.depth = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const GridOrigin from = ray.origin(axis);
    s.origin[axis] = from;
    s.start[axis] = static_cast<float>(static_cast<double>(from.voxel) * map.resolution +
                                       static_cast<double>(from.rest));
    const float d = ray.direction[axis];
    s.direction[axis] = d;
    // a zero would make 0 * inf; a tiny slope reaches as far
    s.inverse[axis] = 1.0f / (std::abs(d) > 1e-12f ? d : std::copysign(1e-12f, d));
    const auto lo = static_cast<std::uint32_t>(offsetof(Bvh8Node, lo)) + 8u * axis;
    const auto hi = static_cast<std::uint32_t>(offsetof(Bvh8Node, hi)) + 8u * axis;
    s.near_side[axis] = s.inverse[axis] >= 0.0f ? lo : hi;
    s.far_side[axis] = s.inverse[axis] >= 0.0f ? hi : lo;
  }
}

/// Which children of the present node the ray enters before its end; `s.enter` says where.
POINTFLIGHT_INLINE std::uint32_t test_node(RayState& s) {
  const Bvh8Node& node = *s.node;
  const auto* bytes = reinterpret_cast<const std::uint8_t*>(&node);
  // origin and scale of the node as distances along the ray
  float corner[4];
  float offsets[4];
  float steps[4];
  std::memcpy(corner, node.origin, 12);
  corner[3] = node.scale;
  for (int k = 0; k < 4; ++k) {
    offsets[k] = (corner[k] - s.start[k]) * s.inverse[k];
    steps[k] = corner[3] * s.inverse[k];
  }
  F8 enter = splat(0.0f);
  F8 leave = splat(s.end);
  for (int axis = 0; axis < 3; ++axis) {
    const F8 step = splat(steps[axis]);
    const F8 offset = splat(offsets[axis]);
    enter = max(enter, offset + load_bytes(bytes + s.near_side[axis]) * step);
    leave = min(leave, offset + load_bytes(bytes + s.far_side[axis]) * step);
  }
  store(enter, s.enter);
  return bits(enter <= leave);
}

/// Looks for the surface; what lies behind it no longer matters.
POINTFLIGHT_INLINE void shorten(const KernelMap& map, BeamState& s) {
  const float a = find_surface(map, s.hits);
  if (a == kNever) return;
  s.first = a;
  const float end = a + map.window;
  s.end = end < s.end ? end : s.end;
}

/// What becomes of what a beam has hit: it ends the beam's way, or all is kept up to the beam's
/// end.
enum class HitMode { kFirst, kAll };

/// Adds the hits among eight lanes; `hit` has a bit for each. `first_word` is the word of lane 0.
template <HitMode kMode>
POINTFLIGHT_INLINE void add_hits(const KernelMap& map,
                                 BeamState& s,
                                 std::uint32_t hit,
                                 const Meeting& meeting,
                                 std::uint32_t first_word,
                                 std::uint64_t& overflows) {
  if (s.hits.count + 8 > kHits) {
    if constexpr (kMode == HitMode::kFirst) shorten(map, s);
    const bool was_lossy = make_room(s.hits, s.end);
    overflows += was_lossy ? 1 : 0;
    // what is kept has no gap: its end is the ray's
    if (kMode == HitMode::kAll && was_lossy) {
      s.end = *std::max_element(s.hits.t, s.hits.t + s.hits.count);
    }
  }
  alignas(32) float t[8];
  alignas(32) float cosine[8];
  alignas(32) std::int32_t weight[8];
  store(meeting.t, t);
  store(meeting.cosine, cosine);
  store(weights_of(map, meeting.m2), weight);
  HitLanes& h = s.hits;
  for (; hit != 0; hit &= hit - 1) {
    const int lane = std::countr_zero(hit);
    h.t[h.count] = t[lane];
    h.weight[h.count] = weight[lane];
    h.cosine[h.count] = cosine[lane];
    h.word[h.count++] = static_cast<std::int32_t>(first_word) + lane;
    h.total += weight[lane];
    h.nearest = std::min(h.nearest, t[lane]);
  }
  store_unaligned(splat(kNever), h.t + h.count);
  if constexpr (kMode == HitMode::kAll) return;
  // if the nearest hit begins the surface, farther ones cannot move it
  if (h.nearest < s.first && h.total >= map.tau) shorten(map, s);
}

template <HitMode kMode>
POINTFLIGHT_INLINE void visit_leaf(const KernelMap& map,
                                   RayState& s,
                                   const Entry& entry,
                                   std::uint64_t& overflows) {
  if (!is_readable_leaf(entry, map.word_count)) return;
  const LeafHeader leaf = decode_leaf(map.words[entry.index]);
  // nothing here depends on the way to the leaf
  const float vx = to_corner(leaf.x, s.origin[0], map.r);
  const float vy = to_corner(leaf.y, s.origin[1], map.r);
  const float vz = to_corner(leaf.z, s.origin[2], map.r);
  const F8 dx = splat(s.direction[0]);
  const F8 dy = splat(s.direction[1]);
  const F8 dz = splat(s.direction[2]);
  const SurfelLanes surfels = load_surfels(map.scale, map.words + entry.index + 1);
  const F8 x = surfels.x + splat(vx);
  const F8 y = surfels.y + splat(vy);
  const F8 z = surfels.z + splat(vz);
  // many leaves are passed at a distance
  const F8 along = dx * x + dy * y + dz * z;
  const F8 px = x - along * dx;
  const F8 py = y - along * dy;
  const F8 pz = z - along * dz;
  const std::uint32_t lanes = (1u << entry.meta) - 1u;
  const M8 near_by =
      px * px + py * py + pz * pz <= surfels.widest * splat(map.support_squared * 1.01f);
  if ((bits(near_by) & lanes) == 0) return;

  const Shapes e = decode_shapes(map.scale, surfels);
  const Meeting meeting = meet(whiten(e, x, y, z), whiten(e, dx, dy, dz), e.s0);
  const M8 accepted = (meeting.m2 < splat(map.support_squared)) & (splat(0.0f) <= meeting.t) &
                      (meeting.t <= splat(s.end));
  const std::uint32_t hit = bits(accepted) & lanes;
  if (hit != 0) add_hits<kMode>(map, s, hit, meeting, entry.index + 1, overflows);
}

/// On to the next inner node, through the leaves on the way. False at the end of the beam's way.
template <HitMode kMode>
POINTFLIGHT_INLINE bool advance(const KernelMap& map,
                                RayState& s,
                                std::uint32_t entered,
                                std::uint64_t& overflows) {
  if (s.steps == 0) return false;
  --s.steps;
  // most often one or two children are entered: the nearer one need not go through the stack
  if (entered != 0) {
    const std::uint64_t meta = meta_of(*s.node);
    const std::uint32_t others = entered & (entered - 1);
    if ((others & (others - 1)) == 0) {
      Entry next = child_of(*s.node, meta, s.enter, std::countr_zero(entered));
      prefetch(map.nodes, map.words, next);
      if (others != 0 && s.depth < kStack) {
        const Entry other = child_of(*s.node, meta, s.enter, std::countr_zero(others));
        prefetch(map.nodes, map.words, other);
        const bool swapped = other.t < next.t;
        s.stack[s.depth++] = swapped ? next : other;
        next = swapped ? other : next;
      }
      if (next.meta != Bvh8Node::kInner) {
        visit_leaf<kMode>(map, s, next, overflows);
      } else if (next.index < map.node_count) {
        s.node = map.nodes + next.index;
        return true;
      }
    } else {
      s.depth = push_children(map.nodes, map.words, *s.node, entered, s.enter, s.stack, s.depth);
    }
  }
  while (s.depth > 0) {
    const Entry entry = s.stack[--s.depth];
    if (entry.t > s.end) continue;
    if (entry.meta != Bvh8Node::kInner) {
      visit_leaf<kMode>(map, s, entry, overflows);
    } else if (entry.index < map.node_count) {
      s.node = map.nodes + entry.index;
      return true;
    }
  }
  return false;
}

/// Single rays, several in flight. `finish(state)` takes each at the end of its way. Returns how
/// many lists overflowed.
template <HitMode kMode, class Finish>
POINTFLIGHT_INLINE std::uint64_t follow_singly(const KernelMap& map,
                                               const MapRay* rays,
                                               const std::uint32_t* order,
                                               std::size_t count,
                                               const Finish& finish) {
  // 130 KB, too large for the small stacks that some shells and embedding programs give; filled by
  // start_ray
  thread_local const auto states = std::make_unique_for_overwrite<RayState[]>(kInFlight);
  RayState* active[kInFlight];
  std::uint32_t entered[kInFlight];
  std::size_t flying = 0;
  std::size_t next = 0;
  std::uint64_t overflows = 0;
  while (flying < kInFlight && next < count) {
    active[flying] = &states[flying];
    start_ray(map, rays[order[next]], order[next], *active[flying]);
    ++flying;
    ++next;
  }
  while (flying > 0) {
    // all node tests first: they do not wait for each other
    for (std::size_t k = 0; k < flying; ++k) entered[k] = test_node(*active[k]);
    for (std::size_t k = 0; k < flying;) {
      RayState& s = *active[k];
      if (advance<kMode>(map, s, entered[k], overflows)) {
        ++k;
        continue;
      }
      finish(s);
      if (next + kInFlight < count) hwy::Prefetch(rays + order[next + kInFlight]);
      if (next < count) {
        start_ray(map, rays[order[next]], order[next], s);
        ++next;
        ++k;
      } else {
        --flying;
        std::swap(active[k], active[flying]);
        entered[k] = entered[flying];
      }
    }
  }
  return overflows;
}

}  // namespace pointflight::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
