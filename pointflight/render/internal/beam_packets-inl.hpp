// Packets: 64 beams that point nearly the same way go through the tree together, eight groups of
// eight. Every pair of a beam and a surfel is computed by the same operations as for single rays,
// so the results are the same bits; what a packet cannot do is traced singly.
//
// Included once a target by Highway's foreach_target; see beam_kernel.cpp.
#if defined(POINTFLIGHT_RENDER_BEAM_PACKETS_INL_HPP) == defined(HWY_TARGET_TOGGLE)
#ifdef POINTFLIGHT_RENDER_BEAM_PACKETS_INL_HPP
#undef POINTFLIGHT_RENDER_BEAM_PACKETS_INL_HPP
#else
#define POINTFLIGHT_RENDER_BEAM_PACKETS_INL_HPP
#endif

#include "pointflight/render/internal/packet_leaf-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace pointflight::HWY_NAMESPACE {

static_assert(kRows <= 128, "shares_of: sums of whole numbers must fit 32 bits");

/// The hit rule for eight beams at once: where the surface of each begins, or kNever.
POINTFLIGHT_INLINE F8 find_surfaces(const KernelMap& map, const HitRows& rows) {
  const F8 never = splat(kNever);
  const F8 window = splat(map.window);
  const I8 tau = splat_int(map.tau - 1);
  F8 result = never;
  F8 tried = splat(-1.0f);
  while (true) {
    F8 nearest = never;
    for (std::size_t i = 0; i < rows.count; ++i) {
      const F8 t = load(rows.t[i]);
      nearest = min(nearest, select(tried < t, t, never));
    }
    const F8 end = nearest + window;
    I8 weight = splat_int(0);
    for (std::size_t i = 0; i < rows.count; ++i) {
      const F8 t = load(rows.t[i]);
      weight = weight + keep((nearest <= t) & (t <= end), load(rows.weight[i]));
    }
    const M8 found = tau < weight;
    result = select(found, nearest, result);
    const M8 pending = without(nearest < never, found);
    if (bits(pending) == 0) return result;
    // lanes that are settled look behind everything
    tried = select(pending, nearest, never);
  }
}

/// Forgets rows behind the ends of all beams.
POINTFLIGHT_INLINE void drop_behind(HitRows& rows, const F8& end) {
  std::size_t kept = 0;
  for (std::size_t i = 0; i < rows.count; ++i) {
    const F8 t = load(rows.t[i]);
    if (bits(t <= end) == 0) continue;
    if (kept != i) {
      store(t, rows.t[kept]);
      store(load(rows.weight[i]), rows.weight[kept]);
      store(load(rows.cosine[i]), rows.cosine[kept]);
      rows.word[kept] = rows.word[i];
    }
    ++kept;
  }
  rows.count = kept;
}

/// Looks for the surfaces of a group that has new hits.
POINTFLIGHT_INLINE void shorten(const KernelMap& map, Packet& p, std::size_t g) {
  Group& group = p.groups[g];
  // if the nearest hit begins the surface, farther ones cannot move it
  const M8 open = load(group.nearest) < load(group.first);
  if (bits(open & (splat_int(map.tau - 1) < load(group.total))) == 0) return;
  HitRows& rows = p.rows[g];
  const F8 first = find_surfaces(map, rows);
  const M8 found = first < splat(kNever);
  if (bits(found) == 0) return;
  store(first, group.first);
  const F8 old_end = load(group.end);
  const F8 end = select(found, min(first + splat(map.window), old_end), old_end);
  store(end, group.end);
  p.group_end[g] = greatest(end);
  p.end = greatest(load(p.group_end));
  if (rows.count > 12) drop_behind(rows, end);
}

/// Tests the surfels of `which` against the eight beams of a group.
template <bool kOneOrigin>
POINTFLIGHT_INLINE void meet_group(
    const KernelMap& map, Packet& p, std::size_t g, const PacketLeaf& leaf, std::uint32_t which) {
  Group& group = p.groups[g];
  const auto from = [&](int axis) {  // the leaf's origin from the beams'
    return to_voxel(map, group, axis, static_cast<std::int32_t>(leaf.corner[axis]));
  };
  const F8 zero = splat(0.0f);
  const F8 from_x = kOneOrigin ? zero : from(0);
  const F8 from_y = kOneOrigin ? zero : from(1);
  const F8 from_z = kOneOrigin ? zero : from(2);
  const F8 dx = load(group.dx);
  const F8 dy = load(group.dy);
  const F8 dz = load(group.dz);
  const F8 end = load(group.end);
  const F8 support = splat(map.support_squared);
  I8 total = load(group.total);
  F8 nearest = load(group.nearest);
  HitRows& rows = p.rows[g];
  const std::size_t before = rows.count;
  for (; which != 0; which &= which - 1) {
    const auto i = static_cast<std::size_t>(std::countr_zero(which));
    const Shapes e = shape_at(leaf, i);
    Whitened u;  // NOLINT(cppcoreguidelines-pro-type-member-init): written below
    if constexpr (kOneOrigin) {
      u = {splat(leaf.whitened[0][i]), splat(leaf.whitened[1][i]), splat(leaf.whitened[2][i])};
    } else {
      u = whiten(e,
                 splat(leaf.center[0][i]) + from_x,
                 splat(leaf.center[1][i]) + from_y,
                 splat(leaf.center[2][i]) + from_z);
    }
    const Meeting meeting = meet(u, whiten(e, dx, dy, dz), e.s0);
    const M8 accepted = (meeting.m2 < support) & (splat(0.0f) <= meeting.t) & (meeting.t <= end);
    if (rows.count == kRows) {
      p.failed |= 1u << g;
      return;
    }
    // a row that no beam hits is written over by the next: half of them, at no pattern
    const I8 weight = keep(accepted, weights_of(map, meeting.m2));
    const F8 met = select(accepted, meeting.t, splat(kNever));
    nearest = min(nearest, met);
    total = total + weight;
    store(met, rows.t[rows.count]);
    store(weight, rows.weight[rows.count]);
    store(meeting.cosine, rows.cosine[rows.count]);
    rows.word[rows.count] = leaf.first_word + static_cast<std::uint32_t>(i);
    rows.count += bits(accepted) != 0 ? 1 : 0;
  }
  if (rows.count == before) return;
  store(total, group.total);
  store(nearest, group.nearest);
  shorten(map, p, g);
}

POINTFLIGHT_INLINE void visit_leaf(const KernelMap& map, Packet& p, const Entry& entry) {
  if (!is_readable_leaf(entry, map.word_count)) return;
  const LeafHeader header = decode_leaf(map.words[entry.index]);
  PacketLeaf leaf;  // NOLINT(cppcoreguidelines-pro-type-member-init): written before it is read
  leaf.lanes = load_surfels(map.scale, map.words + entry.index + 1);
  leaf.first_word = entry.index + 1;
  leaf.count = entry.meta;
  leaf.corner[0] = header.x;
  leaf.corner[1] = header.y;
  leaf.corner[2] = header.z;
  // centres from the apex
  const Place center = {leaf.lanes.x + splat(to_corner(header.x, p.apex[0], map.r)),
                        leaf.lanes.y + splat(to_corner(header.y, p.apex[1], map.r)),
                        leaf.lanes.z + splat(to_corner(header.z, p.apex[2], map.r))};
  const InFrustum in = in_frustum(map, p, leaf, center);
  if (in.surfels == 0) return;
  const Shapes e = decode_shapes(map.scale, leaf.lanes);
  const std::uint64_t pairs = pairs_of(map, p, leaf, e, in);
  if (pairs == 0) return;
  const F8* const shape[10] = {
      &e.m0x, &e.m0y, &e.m0z, &e.m1x, &e.m1y, &e.m1z, &e.m2x, &e.m2y, &e.m2z, &e.s0};
  for (int k = 0; k < 10; ++k) store(*shape[k], leaf.shape[k]);
  if (p.one_origin) {
    const Whitened u = whiten(e, center.x, center.y, center.z);
    store(u.x, leaf.whitened[0]);
    store(u.y, leaf.whitened[1]);
    store(u.z, leaf.whitened[2]);
  } else {
    store(leaf.lanes.x, leaf.center[0]);
    store(leaf.lanes.y, leaf.center[1]);
    store(leaf.lanes.z, leaf.center[2]);
  }
  for (std::size_t g = 0; g < p.count; ++g) {
    const auto which = static_cast<std::uint32_t>(pairs >> (8 * g)) & 0xffu;
    if (which == 0 || (p.failed >> g & 1u) != 0) continue;
    if (p.one_origin) {
      meet_group<true>(map, p, g, leaf, which);
    } else {
      meet_group<false>(map, p, g, leaf, which);
    }
  }
}

POINTFLIGHT_INLINE void walk(const KernelMap& map, Packet& p) {
  Entry stack[kStack];
  std::size_t depth = 0;
  stack[depth++] = {0.0f, 0, Bvh8Node::kInner};
  std::size_t steps = most_steps(map);
  alignas(32) float distances[8];
  while (depth > 0 && steps-- > 0) {
    const Entry entry = stack[--depth];
    if (entry.t > p.end) continue;
    if (entry.meta != Bvh8Node::kInner) {
      visit_leaf(map, p, entry);
      continue;
    }
    if (entry.index >= map.node_count) continue;
    const Bvh8Node& node = map.nodes[entry.index];
    const std::uint32_t entered = test_node(p, node, distances);
    depth = push_children(map.nodes, map.words, node, entered, distances, stack, depth);
  }
}

POINTFLIGHT_INLINE void finish(const KernelMap& map,
                               const Group& group,
                               const HitRows& rows,
                               const std::uint32_t* order,
                               KernelHit* hits) {
  const F8 first = load(group.first);
  I8 weight = splat_int(0);
  I8 depth = splat_int(0);
  I8 cosine = splat_int(0);
  I8 largest = splat_int(-1);
  I8 strongest = splat_int(0);
  for (std::size_t i = 0; i < rows.count; ++i) {
    const F8 t = load(rows.t[i]);
    const I8 w = load(rows.weight[i]);
    const Shares shares = shares_of(map, first, t, w, load(rows.cosine[i]));
    weight = weight + shares.weight;
    depth = depth + shares.depth;
    cosine = cosine + shares.cosine;
    const M8 inside = (first <= t) & (t <= first + splat(map.window));
    const auto word = static_cast<std::int32_t>(rows.word[i]);
    const M8 larger = (largest < w) & inside;
    const M8 same = (largest == w) & (splat_int(word) < strongest) & inside;
    largest = select(larger, w, largest);
    strongest = select(larger, splat_int(word), select(same, splat_int(word), strongest));
  }
  alignas(32) std::int32_t sums[4][8];
  store(weight, sums[0]);
  store(depth, sums[1]);
  store(cosine, sums[2]);
  store(strongest, sums[3]);
  for (std::size_t i = 0; i < 8; ++i) {
    hits[order[i]] = group.first[i] == kNever ? KernelHit{}
                                              : return_of(map,
                                                          group.first[i],
                                                          sums[0][i],
                                                          sums[1][i],
                                                          sums[2][i],
                                                          static_cast<std::uint32_t>(sums[3][i]));
  }
}

}  // namespace pointflight::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
