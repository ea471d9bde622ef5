// The beam kernel for one instruction set: single rays, several of them in flight at once.
//
// Included once a target by Highway's foreach_target; see beam_kernel.cpp. The measurement model is
// in docs/architecture.md ("Hit rule").
#if defined(POINTFLIGHT_RENDER_BEAM_KERNEL_INL_HPP) == defined(HWY_TARGET_TOGGLE)
#ifdef POINTFLIGHT_RENDER_BEAM_KERNEL_INL_HPP
#undef POINTFLIGHT_RENDER_BEAM_KERNEL_INL_HPP
#else
#define POINTFLIGHT_RENDER_BEAM_KERNEL_INL_HPP
#endif

#include <hwy/cache_control.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstring>

#include "pointflight/core/simd8-inl.hpp"
#include "pointflight/map/surfel_lanes-inl.hpp"
#include "pointflight/render/beam_kernel.hpp"

HWY_BEFORE_NAMESPACE();
namespace pointflight::HWY_NAMESPACE {

/// Rays that one thread follows at the same time: while one waits for its node, others compute.
inline constexpr std::size_t kInFlight = 16;
/// 7 siblings a level and 60 levels of Morton bits; a corrupt map stops being followed here.
inline constexpr std::size_t kStack = 512;
inline constexpr std::size_t kHits = 256;
inline constexpr float kNever = 3.0e38f;

struct Entry {
  float t;              ///< Where the beam enters the box.
  std::uint32_t index;  ///< Node, or word of a leaf's header.
  std::uint32_t meta;   ///< Bvh8Node::meta
};

/// Surfels that one beam has met, in no order; lanes behind the last are never met.
struct HitLanes {
  std::size_t count;
  std::int32_t total;  ///< Of the weights: below tau no surface can exist.
  float nearest;       ///< The least t.
  alignas(32) float t[kHits + 16];
  alignas(32) std::int32_t weight[kHits + 16];
  alignas(32) std::int32_t word[kHits + 16];
  alignas(32) float cosine[kHits + 16];  ///< |e0 . d|
};

/// One beam on its way through the tree.
struct RayState {
  alignas(32) float enter[8];    ///< Where it enters the children of the present node.
  alignas(16) float start[4];    ///< Origin from the map's origin, for boxes.
  alignas(16) float inverse[4];  ///< 1 / direction.
  float direction[3];
  std::uint32_t near_side[3];  ///< Byte of the node at which the nearer planes begin, a axis.
  std::uint32_t far_side[3];
  float end;    ///< Nothing beyond matters.
  float first;  ///< Where the surface begins, kNever before one is found.
  double origin[3];
  std::uint32_t ray;
  const Bvh8Node* node;
  std::size_t steps;  ///< More visits than children: a cycle, a corrupt file.
  std::size_t depth;
  Entry stack[kStack];
  HitLanes hits;
};

POINTFLIGHT_INLINE void start_ray(const KernelMap& map,
                                  const Ray& ray,
                                  std::uint32_t index,
                                  RayState& s) {
  s.start[3] = 0.0f;
  s.inverse[3] = 0.0f;
  s.ray = index;
  s.end = ray.range_max;
  s.first = kNever;
  s.node = map.nodes;
  s.steps = map.node_count * 8 + 8;
  s.depth = 0;
  s.hits.count = 0;
  s.hits.total = 0;
  s.hits.nearest = kNever;
  for (int axis = 0; axis < 3; ++axis) {
    s.origin[axis] = ray.origin_world[axis] - map.origin[axis];
    s.start[axis] = static_cast<float>(s.origin[axis]);
    const float d = ray.direction_world[axis];
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

POINTFLIGHT_INLINE std::uint64_t meta_of(const Bvh8Node& node) {
  std::uint64_t meta = 0;
  std::memcpy(&meta, node.meta, 8);
  return meta;
}

/// The child in a lane of a node: inner ones are consecutive, and so are the words of leaves.
POINTFLIGHT_INLINE Entry child_of(const Bvh8Node& node,
                                  std::uint64_t meta,
                                  const float* enter,
                                  int lane) {
  constexpr std::uint64_t kOnes = 0x0101010101010101ull;
  const int shift = 8 * lane;
  const std::uint64_t before = meta & ((1ull << shift) - 1ull);
  const auto own = static_cast<std::uint32_t>(meta >> shift) & 0xffu;
  if (own == Bvh8Node::kInner) {
    const auto nodes_before = static_cast<std::uint32_t>(std::popcount(before & (0x80ull * kOnes)));
    return {enter[lane], node.first_inner + nodes_before, own};
  }
  // a leaf of n surfels has n + 1 words
  const std::uint64_t counts = before & (0x7full * kOnes);
  const std::uint64_t words = counts + (((counts + 0x7full * kOnes) >> 7) & kOnes);
  return {
      enter[lane], node.first_leaf_word + static_cast<std::uint32_t>((words * kOnes) >> 56), own};
}

POINTFLIGHT_INLINE void prefetch(const KernelMap& map, const Entry& entry) {
  const char* place = entry.meta == Bvh8Node::kInner
                          ? reinterpret_cast<const char*>(map.nodes + entry.index)
                          : reinterpret_cast<const char*>(map.words + entry.index);
  hwy::Prefetch(place);
  hwy::Prefetch(place + 64);
}

/// Pushes the children of a node that were entered at `enter`, the nearest on top. Returns the new
/// depth of the stack.
POINTFLIGHT_INLINE std::size_t push_children(const KernelMap& map,
                                             const Bvh8Node& node,
                                             std::uint32_t entered,
                                             const float* enter,
                                             Entry* stack,
                                             std::size_t depth) {
  const std::uint64_t meta = meta_of(node);
  const std::size_t bottom = depth;
  for (; entered != 0 && depth < kStack; entered &= entered - 1) {
    const Entry child = child_of(node, meta, enter, std::countr_zero(entered));
    if (child.meta == 0) continue;
    prefetch(map, child);
    std::size_t at = depth++;
    for (; at > bottom && stack[at - 1].t < child.t; --at) stack[at] = stack[at - 1];
    stack[at] = child;
  }
  return depth;
}

/// A place in the frames of eight surfels, in their standard deviations.
struct Whitened {
  F8 x, y, z;
};

POINTFLIGHT_INLINE Whitened whiten(const Shapes& e, const F8& x, const F8& y, const F8& z) {
  return {e.m0x * x + e.m0y * y + e.m0z * z,
          e.m1x * x + e.m1y * y + e.m1z * z,
          e.m2x * x + e.m2y * y + e.m2z * z};
}

/// What the model says for eight pairs of a beam and a surfel: t = u.v / v.v, m^2 = |u - t v|^2
/// with u = S R (p - o) and v = S R d. In float u is exact to 2^-23 |p - o| / s: at 100 m, r = 0.05
/// m and the least s0 that is 0.05 standard deviations, at most 2 % of M.
struct Meeting {
  F8 t;
  F8 m2;
  F8 cosine;  ///< |e0 . d|
};

POINTFLIGHT_INLINE Meeting meet(const Whitened& u, const Whitened& v, const F8& s0) {
  Meeting result;  // NOLINT(cppcoreguidelines-pro-type-member-init): all is written
  result.t = (u.x * v.x + u.y * v.y + u.z * v.z) / (v.x * v.x + v.y * v.y + v.z * v.z);
  const F8 a0 = u.x - result.t * v.x;
  const F8 a1 = u.y - result.t * v.y;
  const F8 a2 = u.z - result.t * v.z;
  result.m2 = a0 * a0 + a1 * a1 + a2 * a2;
  result.cosine = abs(v.x) * s0;
  return result;
}

/// Weights c (1 - m^2 / M^2)^2 in whole steps; 0 outside the support, and where a corrupt map makes
/// m not a number.
POINTFLIGHT_INLINE I8 weights_of(const KernelMap& map, const F8& m2) {
  const F8 support = splat(map.support_squared);
  const F8 inside = select(m2 < support, m2, support);
  const F8 share = splat(1.0f) - inside * splat(map.inverse_support);
  return to_int(splat(map.weight_scale) * share * share);
}

/// The hit rule: the nearest hit a for which the weights within [t_a, t_a + window] reach tau.
/// Returns its t, or kNever.
POINTFLIGHT_INLINE float find_surface(const KernelMap& map, const HitLanes& hits) {
  float tried = -1.0f;
  while (true) {
    F8 nearest = splat(kNever);
    for (std::size_t i = 0; i < hits.count; i += 8) {
      const F8 t = load(hits.t + i);
      nearest = min(nearest, select(splat(tried) < t, t, splat(kNever)));
    }
    const float a = least(nearest);
    if (a == kNever) return kNever;
    std::int32_t weight = 0;
    const F8 begin = splat(a);
    const F8 end = splat(a + map.window);
    for (std::size_t i = 0; i < hits.count; i += 8) {
      const F8 t = load(hits.t + i);
      weight += sum(keep((begin <= t) & (t <= end), load(hits.weight + i)));
    }
    if (weight >= map.tau) return a;
    tried = a;
  }
}

/// Looks for the surface; what lies behind it no longer matters.
POINTFLIGHT_INLINE void shorten(const KernelMap& map, RayState& s) {
  const float a = find_surface(map, s.hits);
  if (a == kNever) return;
  s.first = a;
  const float end = a + map.window;
  s.end = end < s.end ? end : s.end;
}

/// Room for eight more hits: forgets those behind the end, else the farthest half. True if hits
/// that might have mattered are lost.
static HWY_NOINLINE bool make_room(RayState& s) {
  HitLanes& h = s.hits;
  const auto keep_up_to = [&h](float limit) {
    std::size_t kept = 0;
    h.total = 0;
    for (std::size_t i = 0; i < h.count; ++i) {
      if (h.t[i] > limit) continue;
      h.t[kept] = h.t[i];
      h.weight[kept] = h.weight[i];
      h.word[kept] = h.word[i];
      h.cosine[kept] = h.cosine[i];
      h.total += h.weight[kept++];
    }
    h.count = kept;
    store_unaligned(splat(kNever), h.t + kept);
    store_unaligned(splat(kNever), h.t + kept + 8);
  };
  keep_up_to(s.end);
  if (h.count + 8 <= kHits) return false;
  float sorted[kHits + 16];
  std::copy(h.t, h.t + h.count, sorted);
  std::nth_element(sorted, sorted + kHits / 2, sorted + h.count);
  keep_up_to(std::nextafter(sorted[kHits / 2], 0.0f));
  // more than half at one depth: any of them will do
  h.count = std::min(h.count, kHits - 8);
  store_unaligned(splat(kNever), h.t + h.count);
  return true;
}

/// Adds the hits among eight lanes; `hit` has a bit for each. `first_word` is the word of lane 0.
POINTFLIGHT_INLINE void add_hits(const KernelMap& map,
                                 RayState& s,
                                 std::uint32_t hit,
                                 const Meeting& meeting,
                                 std::uint32_t first_word,
                                 std::uint64_t& overflows) {
  if (s.hits.count + 8 > kHits) {
    shorten(map, s);
    overflows += make_room(s) ? 1 : 0;
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
  // where the nearest hit begins the surface, farther ones cannot move it
  if (h.nearest < s.first && h.total >= map.tau) shorten(map, s);
}

POINTFLIGHT_INLINE void visit_leaf(const KernelMap& map,
                                   RayState& s,
                                   const Entry& entry,
                                   std::uint64_t& overflows) {
  if (entry.meta - 1u > 7u || entry.index + entry.meta + kLeafPadding >= map.word_count) return;
  const LeafHeader leaf = decode_leaf(map.words[entry.index]);
  // in double: maps may be kilometres wide; and nothing here depends on the way to the leaf
  const auto vx = static_cast<float>(leaf.x * map.resolution - s.origin[0]);
  const auto vy = static_cast<float>(leaf.y * map.resolution - s.origin[1]);
  const auto vz = static_cast<float>(leaf.z * map.resolution - s.origin[2]);
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
  if (hit != 0) add_hits(map, s, hit, meeting, entry.index + 1, overflows);
}

/// Shares of a hit in the sums over the surface's window: whole numbers, so that no order shows,
/// and small enough that 128 full weights fit 32 bits (a group of a packet holds kRows).
struct Shares {
  I8 weight, depth, cosine;
};
inline constexpr float kShareSteps = 4096.0f;

POINTFLIGHT_INLINE Shares
shares_of(const KernelMap& map, const F8& first, const F8& t, const I8& weight, const F8& cosine) {
  const M8 inside = (first <= t) & (t <= first + splat(map.window));
  Shares s;  // NOLINT(cppcoreguidelines-pro-type-member-init): all is written
  s.weight = keep(inside, right<8>(weight));
  // lanes outside may be anything: they count nothing
  const F8 behind = select(inside, t - first, splat(0.0f));
  s.depth = s.weight * to_int(behind * splat(kShareSteps / map.window));
  const F8 turned = select(inside, cosine, splat(0.0f));
  s.cosine = s.weight * to_int(turned * splat(kShareSteps));
  return s;
}

POINTFLIGHT_INLINE KernelHit return_of(const KernelMap& map,
                                       float first,
                                       std::int64_t weight,
                                       std::int64_t depth,
                                       std::int64_t cosine,
                                       std::uint32_t strongest) {
  const float total = static_cast<float>(weight) * kShareSteps;
  KernelHit hit;
  hit.range = first + static_cast<float>(depth) / total * map.window;
  hit.cos_incidence = std::min(1.0f, static_cast<float>(cosine) / total);
  hit.strongest = strongest;
  return hit;
}

/// The return: weighted means over the window.
POINTFLIGHT_INLINE KernelHit finish(const KernelMap& map, const RayState& s) {
  if (s.first == kNever) return {};
  const F8 first = splat(s.first);
  // a full list can pass 32 bits; eight lanes of it cannot
  std::int64_t weight = 0;
  std::int64_t depth = 0;
  std::int64_t cosine = 0;
  std::int32_t largest = -1;
  std::uint32_t strongest = 0;
  for (std::size_t i = 0; i < s.hits.count; i += 8) {
    const Shares shares =
        shares_of(map, first, load(s.hits.t + i), load(s.hits.weight + i), load(s.hits.cosine + i));
    weight += sum(shares.weight);
    depth += sum(shares.depth);
    cosine += sum(shares.cosine);
  }
  const float end = s.first + map.window;
  for (std::size_t i = 0; i < s.hits.count; ++i) {
    if (!(s.hits.t[i] >= s.first) || !(s.hits.t[i] <= end)) continue;
    const auto word = static_cast<std::uint32_t>(s.hits.word[i]);
    const std::int32_t w = s.hits.weight[i];
    if (w > largest || (w == largest && word < strongest)) {
      largest = w;
      strongest = word;
    }
  }
  return return_of(map, s.first, weight, depth, cosine, strongest);
}

/// On to the next inner node, through the leaves on the way. False at the end of the beam's way.
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
      prefetch(map, next);
      if (others != 0 && s.depth < kStack) {
        const Entry other = child_of(*s.node, meta, s.enter, std::countr_zero(others));
        prefetch(map, other);
        const bool swapped = other.t < next.t;
        s.stack[s.depth++] = swapped ? next : other;
        next = swapped ? other : next;
      }
      if (next.meta != Bvh8Node::kInner) {
        visit_leaf(map, s, next, overflows);
      } else if (next.index < map.node_count) {
        s.node = map.nodes + next.index;
        return true;
      }
    } else {
      s.depth = push_children(map, *s.node, entered, s.enter, s.stack, s.depth);
    }
  }
  while (s.depth > 0) {
    const Entry entry = s.stack[--s.depth];
    if (entry.t > s.end) continue;
    if (entry.meta != Bvh8Node::kInner) {
      visit_leaf(map, s, entry, overflows);
    } else if (entry.index < map.node_count) {
      s.node = map.nodes + entry.index;
      return true;
    }
  }
  return false;
}

/// Single rays, several in flight. Returns how many lists overflowed.
static std::uint64_t trace_singly(const KernelMap& map,
                                  const Ray* rays,
                                  const std::uint32_t* order,
                                  std::size_t count,
                                  KernelHit* hits) {
  if (map.node_count == 0) {
    for (std::size_t i = 0; i < count; ++i) hits[order[i]] = {};
    return 0;
  }
  RayState states[kInFlight];  // NOLINT(cppcoreguidelines-pro-type-member-init): by start_ray
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
      if (advance(map, s, entered[k], overflows)) {
        ++k;
        continue;
      }
      hits[s.ray] = finish(map, s);
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
