// Bundles: up to 64 beams that lie too far apart to hit the same surfels, but near enough to share
// the nodes above them. They go down the tree together, each child with a mask of the beams that
// may enter its box as seen from the apex; at a leaf each beam hits the eight surfels by itself,
// by the operations of a single ray, so that the results are the same bits. A single ray spends
// more than half of its time on nodes: here most of it is shared.
//
// Included once a target by Highway's foreach_target; see beam_kernel.cpp.
#if defined(POINTFLIGHT_RENDER_BUNDLE_INL_HPP) == defined(HWY_TARGET_TOGGLE)
#ifdef POINTFLIGHT_RENDER_BUNDLE_INL_HPP
#undef POINTFLIGHT_RENDER_BUNDLE_INL_HPP
#else
#define POINTFLIGHT_RENDER_BUNDLE_INL_HPP
#endif

#include <cstring>

#include "pointflight/render/internal/beam_groups-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace pointflight::HWY_NAMESPACE {

/// A node or leaf that waits to be visited by some beams of a bundle.
struct BundleEntry {
  Entry place;          ///< Its t: no beam reaches it earlier.
  std::uint64_t beams;  ///< A bit for each that may enter.
};

/// Beams on their way down together, and what waits for them.
struct BundleWay : BeamGroups {
  alignas(32) float at_u[kGroups][8], at_v[kGroups][8];  ///< Of each beam: d.u / d.w, d.v / d.w.
  alignas(32) float group_low[2][8], group_high[2][8];   ///< Around each group, in u and in v.
  float across[3][3];                                    ///< |u|, |v|, |w| by axis.
  float room_u, room_v;                                  ///< By which boxes are widened, rad,
  float deeper_u, deeper_v;                              ///< and by half their depth times these.
  std::uint32_t visits;                                  ///< Of nodes and leaves.
  std::size_t depth;
  BundleEntry stack[kStack];
};

struct Bundle : BundleWay {
  std::uint64_t failed;  ///< Beams to be traced singly.
  BeamState beams[kTogether];
};

/// Room for rounding, rad: 0.4 mm at 100 m.
inline constexpr float kBundleRoom = 4e-6f;

/// Sets up the way of groups whose frustum is set up, and whose beams are no wider than lines.
POINTFLIGHT_INLINE void set_up_way(BundleWay& b) {
  for (std::size_t g = 0; g < b.count; ++g) {
    const Group& group = b.groups[g];
    const F8 dx = load(group.dx);
    const F8 dy = load(group.dy);
    const F8 dz = load(group.dz);
    const auto along = [&](const float* axis) {
      return dx * splat(axis[0]) + dy * splat(axis[1]) + dz * splat(axis[2]);
    };
    const F8 per_ahead = splat(1.0f) / along(b.w);
    store(along(b.u) * per_ahead, b.at_u[g]);
    store(along(b.v) * per_ahead, b.at_v[g]);
  }
  store(load(b.middle_u) - load(b.half_u), b.group_low[0]);
  store(load(b.middle_u) + load(b.half_u), b.group_high[0]);
  store(load(b.middle_v) - load(b.half_v), b.group_low[1]);
  store(load(b.middle_v) + load(b.half_v), b.group_high[1]);
  for (int axis = 0; axis < 3; ++axis) {
    b.across[0][axis] = std::abs(b.u[axis]);
    b.across[1][axis] = std::abs(b.v[axis]);
    b.across[2][axis] = std::abs(b.w[axis]);
  }
  b.room_u = b.room_v = kBundleRoom;
  b.deeper_u = b.deeper_v = 0.0f;
  b.visits = 0;
  b.depth = 0;
}

/// Makes all beams wider by so much to each side in u and v, rad. A box is entered by its far end,
/// where they are widest.
POINTFLIGHT_INLINE void widen(BundleWay& b, float wider_u, float wider_v) {
  b.low_u -= wider_u;
  b.high_u += wider_u;
  b.low_v -= wider_v;
  b.high_v += wider_v;
  b.room_u += wider_u;
  b.room_v += wider_v;
  b.deeper_u += 2.0f * wider_u;
  b.deeper_v += 2.0f * wider_v;
}

/// Sets up a bundle of the first `count` groups.
POINTFLIGHT_INLINE void set_up_bundle(const KernelMap& map, Bundle& b, std::size_t count) {
  set_up(map, b, count);
  set_up_way(b);
  for (std::size_t n = 0; n < 8 * count; ++n) {
    start_beam(b.groups[n / 8].end[n % 8], b.beams[n]);
  }
  b.failed = 0;
}

/// Eight boxes as a bundle sees them from its apex.
struct SeenBoxes {  // NOLINT(cppcoreguidelines-pro-type-member-init): all is written
  F8 low_u, high_u, low_v, high_v;  ///< Rectangles in the plane at distance 1 along w.
  F8 begin;                         ///< Along w, m: no beam is there earlier.
  std::uint32_t in_frustum = 0;     ///< A bit for each.
};

/// The children's boxes: c + e with |e_k| <= h_k. Its points lie (e.(u - c_u w)) / ((c + e).w)
/// beside its middle c_u = (c.u) / (c.w), and |e.u| <= h.|u|.
POINTFLIGHT_INLINE SeenBoxes see(const BundleWay& b, const Bvh8Node& node) {
  F8 u = splat(0.0f);
  F8 v = splat(0.0f);
  F8 w = splat(0.0f);
  // other origins lie up to the spread beside the apex
  F8 half_u = splat(b.spread);
  F8 half_v = splat(b.spread);
  F8 half_w = splat(b.spread);
  const F8 scale = splat(0.5f * node.scale);
  for (int k = 0; k < 3; ++k) {
    const F8 low = load_bytes(node.lo[k]);
    const F8 high = load_bytes(node.hi[k]);
    const F8 middle = splat(node.origin[k] - b.apex_box[k]) + (low + high) * scale;
    const F8 half = (high - low) * scale;
    u = u + middle * splat(b.u[k]);
    v = v + middle * splat(b.v[k]);
    w = w + middle * splat(b.w[k]);
    half_u = half_u + half * splat(b.across[0][k]);
    half_v = half_v + half * splat(b.across[1][k]);
    half_w = half_w + half * splat(b.across[2][k]);
  }
  half_u = half_u + half_w * splat(b.deeper_u);
  half_v = half_v + half_w * splat(b.deeper_v);
  SeenBoxes seen;  // NOLINT(cppcoreguidelines-pro-type-member-init): all is written
  seen.begin = w - half_w;
  // around the apex a box lies in any direction
  const M8 ahead = splat(0.0f) < seen.begin;
  const F8 per_depth = splat(1.0f) / w;
  const F8 per_begin = splat(1.0f) / seen.begin;
  const F8 c_u = u * per_depth;
  const F8 c_v = v * per_depth;
  const F8 beside_u = (half_u + abs(c_u) * half_w) * per_begin + splat(b.room_u);
  const F8 beside_v = (half_v + abs(c_v) * half_w) * per_begin + splat(b.room_v);
  const F8 everywhere = splat(1e30f);
  seen.low_u = select(ahead, c_u - beside_u, splat(-1e30f));
  seen.high_u = select(ahead, c_u + beside_u, everywhere);
  seen.low_v = select(ahead, c_v - beside_v, splat(-1e30f));
  seen.high_v = select(ahead, c_v + beside_v, everywhere);
  // the frustum's sides: how far inside the corner is that lies farthest inside
  const auto inside = [&](const F8& c, const F8& half, float low, float high) {
    return min(c - w * splat(low) + half + half_w * splat(std::abs(low)),
               w * splat(high) - c + half + half_w * splat(std::abs(high)));
  };
  const F8 in = min(inside(u, half_u, b.low_u, b.high_u), inside(v, half_v, b.low_v, b.high_v));
  const M8 met = (splat(-1e-4f * node.scale) <= in) & (splat(0.0f) <= w + half_w) &
                 (seen.begin <= splat(b.end));
  seen.in_frustum = bits(met);
  return seen;
}

/// Rectangles of eight boxes, and where they begin: to be looked at one by one.
struct BoxLanes {  // NOLINT(cppcoreguidelines-pro-type-member-init): all is written
  alignas(32) float low_u[8], high_u[8], low_v[8], high_v[8], begin[8];
};

/// The beams of the bundle that may enter one box, by groups of eight.
POINTFLIGHT_INLINE std::uint64_t beams_in_box(const BundleWay& b, const BoxLanes& boxes, int lane) {
  const F8 from_u = splat(boxes.low_u[lane]);
  const F8 to_u = splat(boxes.high_u[lane]);
  const F8 from_v = splat(boxes.low_v[lane]);
  const F8 to_v = splat(boxes.high_v[lane]);
  const F8 t = splat(boxes.begin[lane]);
  std::uint32_t groups = bits((from_u <= load(b.group_high[0])) & (load(b.group_low[0]) <= to_u) &
                              (from_v <= load(b.group_high[1])) & (load(b.group_low[1]) <= to_v) &
                              (t <= load(b.group_end)));
  std::uint64_t entering = 0;
  for (; groups != 0; groups &= groups - 1) {
    const auto g = static_cast<std::size_t>(std::countr_zero(groups));
    const F8 at_u = load(b.at_u[g]);
    const F8 at_v = load(b.at_v[g]);
    const M8 in = (from_u <= at_u) & (at_u <= to_u) & (from_v <= at_v) & (at_v <= to_v) &
                  (t <= load(b.groups[g].end));
    entering |= static_cast<std::uint64_t>(bits(in)) << (8 * g);
  }
  return entering;
}

/// As many beams as this are asked one by one which of eight boxes they may enter, not the boxes
/// which groups of beams.
inline constexpr int kFewBeams = 24;

/// For each of `beams` the boxes that it may enter, a bit each; 0 for the others.
POINTFLIGHT_INLINE void boxes_of_beams(const BundleWay& b,
                                       const SeenBoxes& seen,
                                       std::uint64_t beams,
                                       std::uint8_t (&boxes)[kTogether]) {
  std::memset(boxes, 0, sizeof(boxes));
  for (; beams != 0; beams &= beams - 1) {
    const auto n = static_cast<std::size_t>(std::countr_zero(beams));
    const F8 at_u = splat(b.at_u[n >> 3][n & 7]);
    const F8 at_v = splat(b.at_v[n >> 3][n & 7]);
    const M8 in = (seen.low_u <= at_u) & (at_u <= seen.high_u) & (seen.low_v <= at_v) &
                  (at_v <= seen.high_v) & (seen.begin <= splat(b.groups[n >> 3].end[n & 7]));
    boxes[n] = static_cast<std::uint8_t>(bits(in) & seen.in_frustum);
  }
}

/// The beams that may enter box `lane`.
POINTFLIGHT_INLINE std::uint64_t beams_of_box(const std::uint8_t (&boxes)[kTogether], int lane) {
  const hn::CappedTag<std::uint8_t, kTogether> bytes;
  const auto bit = hn::Set(bytes, static_cast<std::uint8_t>(1u << lane));
  std::uint64_t beams = 0;
  for (std::size_t i = 0; i < kTogether; i += hn::Lanes(bytes)) {
    std::uint8_t part[8] = {};
    hn::StoreMaskBits(bytes, hn::TestBit(hn::LoadU(bytes, boxes + i), bit), part);
    std::uint64_t word = 0;
    std::memcpy(&word, part, sizeof(word));
    beams |= word << i;
  }
  return beams;
}

/// Pushes the children of a node that some of the beams may enter, the nearest on top.
POINTFLIGHT_INLINE void enter_children(const KernelMap& map,
                                       BundleWay& b,
                                       const Bvh8Node& node,
                                       std::uint64_t beams) {
  const SeenBoxes seen = see(b, node);
  std::uint32_t which = seen.in_frustum;
  if (which == 0) return;
  BoxLanes boxes;  // NOLINT(cppcoreguidelines-pro-type-member-init): all is written
  store(seen.begin, boxes.begin);
  std::uint8_t of_beams[kTogether];
  const bool are_few = std::popcount(beams) <= kFewBeams;
  if (are_few) {
    boxes_of_beams(b, seen, beams, of_beams);
  } else {
    store(seen.low_u, boxes.low_u);
    store(seen.high_u, boxes.high_u);
    store(seen.low_v, boxes.low_v);
    store(seen.high_v, boxes.high_v);
  }
  const std::uint64_t meta = meta_of(node);
  const std::size_t bottom = b.depth;
  for (; which != 0 && b.depth < kStack; which &= which - 1) {
    const int lane = std::countr_zero(which);
    const Entry child = child_of(node, meta, boxes.begin, lane);
    if (child.meta == 0) continue;
    const std::uint64_t entering =
        are_few ? beams_of_box(of_beams, lane) : beams & beams_in_box(b, boxes, lane);
    if (entering == 0) continue;
    prefetch(map.nodes, map.words, child);
    std::size_t at = b.depth++;
    for (; at > bottom && b.stack[at - 1].place.t < child.t; --at) b.stack[at] = b.stack[at - 1];
    b.stack[at] = {child, entering};
  }
}

/// The surfels of a leaf against each of the beams.
template <bool kOneOrigin>
POINTFLIGHT_INLINE void visit_leaf(const KernelMap& map, Bundle& b, const BundleEntry& entry) {
  if (!is_readable_leaf(entry.place, map.word_count)) return;
  const LeafHeader header = decode_leaf(map.words[entry.place.index]);
  const SurfelLanes surfels = load_surfels(map.scale, map.words + entry.place.index + 1);
  const std::uint32_t lanes = (1u << entry.place.meta) - 1u;
  const Shapes e = decode_shapes(map.scale, surfels);
  const auto from = [&](const GridOrigin& x, const GridOrigin& y, const GridOrigin& z) {
    return whiten(e,
                  surfels.x + splat(to_corner(header.x, x, map.r)),
                  surfels.y + splat(to_corner(header.y, y, map.r)),
                  surfels.z + splat(to_corner(header.z, z, map.r)));
  };
  Whitened u = from(b.apex[0], b.apex[1], b.apex[2]);
  std::uint32_t shorter = 0;  // groups with beams that end earlier now
  for (std::uint64_t beams = entry.beams; beams != 0; beams &= beams - 1) {
    const auto n = static_cast<std::size_t>(std::countr_zero(beams));
    const std::size_t g = n >> 3;
    const std::size_t i = n & 7;
    Group& group = b.groups[g];
    BeamState& s = b.beams[n];
    if (s.end < entry.place.t) continue;
    if constexpr (!kOneOrigin) {
      u = from(group.origin(0, i), group.origin(1, i), group.origin(2, i));
    }
    const Meeting meeting =
        meet(u, whiten(e, splat(group.dx[i]), splat(group.dy[i]), splat(group.dz[i])), e.s0);
    const M8 accepted = (meeting.m2 < splat(map.support_squared)) & (splat(0.0f) <= meeting.t) &
                        (meeting.t <= splat(s.end));
    const std::uint32_t hit = bits(accepted) & lanes;
    if (hit == 0) continue;
    std::uint64_t overflows = 0;
    add_hits<HitMode::kFirst>(map, s, hit, meeting, entry.place.index + 1, overflows);
    if (overflows != 0) b.failed |= std::uint64_t{1} << n;
    if (!(s.end < group.end[i])) continue;
    group.end[i] = s.end;
    shorter |= 1u << g;
  }
  if (shorter == 0) return;
  for (; shorter != 0; shorter &= shorter - 1) {
    const auto g = static_cast<std::size_t>(std::countr_zero(shorter));
    b.group_end[g] = greatest(load(b.groups[g].end));
  }
  b.end = greatest(load(b.group_end));
}

/// The way of a bundle through the tree.
POINTFLIGHT_INLINE void walk(const KernelMap& map, Bundle& b) {
  b.stack[b.depth++] = {{0.0f, 0, Bvh8Node::kInner}, ~std::uint64_t{0}};
  std::size_t steps = most_steps(map);
  while (b.depth > 0 && steps-- > 0) {
    const BundleEntry entry = b.stack[--b.depth];
    if (entry.place.t > b.end) continue;
    ++b.visits;
    if (entry.place.meta == Bvh8Node::kInner) {
      if (entry.place.index >= map.node_count) continue;
      enter_children(map, b, map.nodes[entry.place.index], entry.beams);
    } else if (b.one_origin) {
      visit_leaf<true>(map, b, entry);
    } else {
      visit_leaf<false>(map, b, entry);
    }
  }
}

}  // namespace pointflight::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
