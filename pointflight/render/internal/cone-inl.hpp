// Wide beams by one way down the tree for up to 64 of them: cones that take the surfels they touch
// along in lists, look at eight of their sub-rays when these could all have hit something, end
// where they have, and at the end take more sub-rays over the list if the eight left doubt.
//
// Included once a target by Highway's foreach_target; see cone_kernel.cpp.
#if defined(POINTFLIGHT_RENDER_CONE_INL_HPP) == defined(HWY_TARGET_TOGGLE)
#ifdef POINTFLIGHT_RENDER_CONE_INL_HPP
#undef POINTFLIGHT_RENDER_CONE_INL_HPP
#else
#define POINTFLIGHT_RENDER_CONE_INL_HPP
#endif

#include <span>

#include "pointflight/render/internal/cone_echoes-inl.hpp"
#include "pointflight/render/internal/cone_kernel.hpp"
#include "pointflight/render/internal/grouping-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace pointflight::HWY_NAMESPACE {

/// A beam's way is looked at when so much of its axis is covered since the last look.
inline constexpr float kCoverToLook = 0.6f * kWeightSteps;
/// A beam ends so many windows behind the farthest beginning of what its eight sub-rays hit:
/// earlier looks, which knew less, can only have put the end farther away, so that the last one
/// counts.
inline constexpr float kWindowsBehind = 1.5f;
/// In front of what sub-rays hit is what is nearer by so much, m.
inline constexpr float kBefore = 0.3f;

/// What all beams of a call share, and room for one at a time.
struct ConeRoom {  // NOLINT(cppcoreguidelines-pro-type-member-init): written before it is read
  ConeBundle bundle;
  SubRayRows rows;
  BeamParts parts;
  ConeStrips strips;
};
struct ConeCall {
  const KernelMap& map;
  const SurfelMap& surfels;
  const MapRay* rays;
  const WideBeams& wide;
  const Reflectances reflectances;
  const SureEchoes sure;
  const SubRayLanes& eight;
  ConeRoom& room;
};

/// The eight sub-rays of the first level, up to the beam's end. True if all have hit something:
/// nothing behind the farthest counts, and the beam ends there.
POINTFLIGHT_INLINE bool look(const ConeCall& call, ConeBeam& beam) {
  const F8 first = hit_sub_rays(call.map,
                                call.room.bundle,
                                beam.list,
                                see(beam, call.eight),
                                beam.end,
                                call.room.rows,
                                beam.eight);
  beam.looked = beam.list.count;
  beam.cover = 0.0f;
  const float farthest = greatest(first);
  if (farthest == kNever) return false;
  end_at(std::min(beam.end, farthest + kWindowsBehind * call.map.window), beam);
  forget_behind(call.room.bundle, beam);
  beam.looked = beam.list.count;
  return true;
}

/// Looks at beams of `which` that are due before depth `t` (m). Returns those whose way goes on to
/// there: some that have ended may be among them.
POINTFLIGHT_INLINE std::uint64_t look_at_due(const ConeCall& call, std::uint64_t which, float t) {
  ConeBundle& b = call.room.bundle;
  if (t <= b.first_look) return which;
  const F8 here = splat(t);
  F8 next = splat(kNever);
  std::uint64_t going_on = 0;
  std::uint32_t shorter = 0;  // groups
  for (std::size_t g = 0; g < b.count; ++g) {
    const auto mine = static_cast<std::uint32_t>(which >> (8 * g)) & 0xffu;
    std::uint32_t due = bits(load(b.look_behind[g]) < here) & mine;
    for (; due != 0; due &= due - 1) {
      const auto i = static_cast<std::size_t>(std::countr_zero(due));
      ConeBeam& beam = b.beams[8 * g + i];
      b.look_behind[g][i] = kNever;
      if (!look(call, beam)) continue;
      b.groups[g].end[i] = beam.numbers[kDeepest];
      shorter |= 1u << g;
    }
    next = min(next, load(b.look_behind[g]));
    const std::uint32_t on = bits(here <= load(b.groups[g].end)) & mine;
    going_on |= static_cast<std::uint64_t>(on) << (8 * g);
  }
  b.first_look = least(next);
  if (shorter == 0) return going_on;
  for (; shorter != 0; shorter &= shorter - 1) {
    const auto g = static_cast<std::size_t>(std::countr_zero(shorter));
    b.group_end[g] = greatest(load(b.groups[g].end));
  }
  b.end = greatest(load(b.group_end));
  return going_on;
}

/// The beams that may touch surfels of a leaf, and which.
struct NearBeams {  // NOLINT(cppcoreguidelines-pro-type-member-init): written before it is read
  std::uint8_t numbers[kTogether];
  std::uint8_t lanes[kTogether];  ///< A bit for each surfel.
  std::size_t count;
};

/// Those of the bundle's pairs that touch into their beams' lists.
POINTFLIGHT_INLINE void touch_pairs(const ConeCall& call,
                                    const ConeLeaf& leaf,
                                    const NearBeams& near_by) {
  ConeBundle& b = call.room.bundle;
  const ConeBeam& axes = b.beams[0];
  for (std::size_t at = 0; at < b.pairs.count; at += 8) touch_eight(call.map, leaf, axes, at, b);
  std::size_t at = 0;
  for (std::size_t k = 0; k < near_by.count; ++k) {
    const std::size_t n = near_by.numbers[k];
    ConeBeam& beam = b.beams[n];
    const auto count = static_cast<std::size_t>(std::popcount(near_by.lanes[k]));
    take_touched(b.pairs, at, count, beam);
    at += count;
    const float look_behind = beam.cover >= kCoverToLook ? beam.far + call.map.window : kNever;
    b.look_behind[n >> 3][n & 7] = look_behind;
    b.first_look = std::min(b.first_look, look_behind);
  }
}

/// A leaf's surfels into the lists of the beams that touch them.
template <bool kOneOrigin>
POINTFLIGHT_INLINE void visit_leaf(const ConeCall& call, const BundleEntry& entry) {
  const KernelMap& map = call.map;
  ConeBundle& b = call.room.bundle;
  if (!is_readable_leaf(entry.place, map.word_count)) return;
  std::uint64_t beams = look_at_due(call, entry.beams, entry.place.t);
  if (beams == 0) return;
  const ConeLeaf leaf = cone_leaf(map, entry.place);
  float corner[3];
  const auto set_corner = [&](std::size_t n) {
    for (int k = 0; k < 3; ++k) {
      corner[k] = to_corner(leaf.corner[k], b.groups[n >> 3].origin(k, n & 7), map.r);
    }
  };
  set_corner(0);
  // first the beams that may touch, then their pairs with surfels, eight at a time: one by one,
  // most lanes would be idle and most branches wrong
  NearBeams near_by;  // NOLINT(cppcoreguidelines-pro-type-member-init): written before it is read
  near_by.count = 0;
  for (; beams != 0; beams &= beams - 1) {
    const auto n = static_cast<std::size_t>(std::countr_zero(beams));
    if constexpr (!kOneOrigin) set_corner(n);
    const ConeBeam& beam = b.beams[n];
    const std::uint32_t lanes = may_touch(leaf, beam, see(leaf, beam, corner));
    near_by.numbers[near_by.count] = static_cast<std::uint8_t>(n);
    near_by.lanes[near_by.count] = static_cast<std::uint8_t>(lanes);
    near_by.count += lanes != 0 ? 1 : 0;
  }
  const bool is_full = b.used + 2 * kTogether > std::size(b.pool);
  b.pairs.count = 0;
  for (std::size_t k = 0; k < near_by.count; ++k) {
    const std::size_t n = near_by.numbers[k];
    ConeBeam& beam = b.beams[n];
    if (beam.list.count + 8 > b.most || is_full) {
      beam.failed = true;
      near_by.lanes[k] = 0;
    }
    if constexpr (!kOneOrigin) set_corner(n);
    add_pairs(beam, see(leaf, beam, corner), near_by.lanes[k], b.pairs);
  }
  touch_pairs(call, leaf, near_by);
}

/// The way of a bundle through the tree; `beams` has a bit for each that goes.
POINTFLIGHT_INLINE void walk(const ConeCall& call, std::uint64_t beams) {
  const KernelMap& map = call.map;
  ConeBundle& b = call.room.bundle;
  b.stack[b.depth++] = {{0.0f, 0, Bvh8Node::kInner}, beams};
  std::size_t steps = most_steps(map);
  while (b.depth > 0 && steps-- > 0) {
    const BundleEntry entry = b.stack[--b.depth];
    if (entry.place.t > b.end) continue;
    if (entry.place.meta == Bvh8Node::kInner) {
      if (entry.place.index >= map.node_count) continue;
      const std::uint64_t going_on = look_at_due(call, entry.beams, entry.place.t);
      if (going_on != 0) enter_children(map, b, map.nodes[entry.place.index], going_on);
    } else if (b.one_origin) {
      visit_leaf<true>(call, entry);
    } else {
      visit_leaf<false>(call, entry);
    }
  }
}

/// Sub-rays of a beam with more surfels than its list has room for though it goes alone, as lines.
static HWY_NOINLINE void hit_as_lines(const ConeCall& call,
                                      const ConeBeam& beam,
                                      const SubRayLanes& sub_rays,
                                      SubRayHits& hits) {
  constexpr std::uint32_t kOrder[8] = {0, 1, 2, 3, 4, 5, 6, 7};
  MapRay rays[8];
  KernelHit found[8];
  for (std::size_t i = 0; i < 8; ++i) {
    rays[i] = call.rays[beam.ray];
    const auto along = [&](int k) {
      return beam.direction[k] + sub_rays.x[i] * beam.across[k] + sub_rays.y[i] * beam.up[k];
    };
    Vector3f direction;
    direction[beam.u] = along(0);
    direction[beam.v] = along(1);
    direction[beam.w] = beam.forward * along(2);
    direction.normalize();
    for (int k = 0; k < 3; ++k) rays[i].direction[k] = direction[k];
  }
  trace_singly({call.map, rays, found}, kOrder, 8);
  for (std::size_t i = 0; i < 8; ++i) {
    hits.range[i] = found[i].range < 0.0f ? kNever : found[i].range;
    hits.cosine[i] = found[i].cos_incidence;
    hits.word[i] = static_cast<std::int32_t>(found[i].strongest);
  }
}

/// The parts of a further level's sub-rays into `parts`.
static HWY_NOINLINE void take_level(const ConeCall& call, const ConeBeam& beam, std::size_t level) {
  BeamParts& parts = call.room.parts;
  const ConeBundle& b = call.room.bundle;
  ConeStrips& strips = call.room.strips;
  // as lines they are dear: eight must do
  const bool has_strips = !beam.failed && beam.list.count >= kFewestForStrips;
  // whether or not there are strips: how many surfels a list has behind what counts is chance
  const std::size_t direction = direction_of_strips(call.eight, beam.eight);
  const std::span<const SubRayLanes> sub_rays =
      beam.failed ? std::span(&call.eight, 1) : std::span(sub_rays_of_level(level, direction));
  parts.eights = sub_rays.size();
  parts.sub_rays = sub_rays.data();
  if (has_strips) set_up_strips(call.map, b, beam, direction, strips);
  for (std::size_t k = 0; k < parts.eights; ++k) {
    SubRayHits& hits = parts.hits[k];
    if (beam.failed) {
      hit_as_lines(call, beam, sub_rays[k], hits);
      continue;
    }
    const SeenSubRays seen = see(beam, sub_rays[k]);
    if (has_strips) take_strip(beam.list, seen, strips);
    hit_sub_rays(
        call.map, b, has_strips ? strips.part : beam.list, seen, beam.end, call.room.rows, hits);
  }
  light_up(call.surfels, call.reflectances, parts);
}

/// True if eight sub-rays are the beam: they hit one plane, or nothing, and nothing is between
/// them.
POINTFLIGHT_INLINE bool is_settled(const ConeCall& call, const ConeBeam& beam) {
  if (beam.failed) return false;
  const F8 range = load(beam.eight.range);
  const std::uint32_t hit = bits(range < splat(kNever));
  if (hit != 0 && hit != 0xffu) return false;
  if (hit != 0 && !lie_in_plane(call.eight, beam.eight)) return false;
  return !has_before(call.room.bundle, beam, call.eight, range, kBefore);
}

/// True if what eight sub-rays are off by may decide whether an echo is reported: they are on the
/// rim and in the middle, where reflectivities may differ from what lies between.
POINTFLIGHT_INLINE bool is_marginal(const SureEchoes& known,
                                    const EchoReceiver& receiver,
                                    const Echo& echo) {
  constexpr double kOff = 0.15;
  const std::span<const float> sure = known.reflectivities;
  if (sure.empty()) return false;
  const float step = echo.range * known.steps_per_m;
  const auto last = static_cast<float>(sure.size() - 1);
  const auto at = static_cast<std::size_t>(std::clamp(step, 0.0f, last));
  if (echo.reflectivity >= sure[at]) return false;
  return receiver.is_marginal(echo, 1.0 - kOff, 1.0 + kOff);
}

/// The echoes of a beam at the end of its way.
static HWY_NOINLINE void finish(const ConeCall& call, ConeBeam& beam) {
  Echoes& echoes = call.wide.echoes[beam.ray];
  if (beam.list.count == 0) {
    echoes.count = 0;
    echoes.all_hit = false;
    return;
  }
  // eight that know all of the list: its end is the same whatever was looked at before
  if (beam.looked != beam.list.count) look(call, beam);
  if (is_settled(call, beam)) {
    const float farthest = greatest(load(beam.eight.range));
    echoes.all_hit = farthest < kNever;  // or none: they are settled
    echoes.count = echoes.all_hit ? 1 : 0;
    if (echoes.count == 0) return;
    echoes.all[0] = echo_of_eight(call.surfels, call.reflectances, call.eight, beam.eight);
    if (!is_marginal(call.sure, *call.wide.receiver, echoes.all[0])) return;
  }
  BeamParts& parts = call.room.parts;
  for (std::size_t level = 1; level < kSubRayLevels; ++level) {
    take_level(call, beam, level);
    make_echoes(parts, call.wide.merge, echoes);
    if (beam.failed) return;
    // what 96 have not hit is no surface, only surfels; what 32 have not is not the strongest
    const bool has_missed =
        level == 1 && !call.wide.receiver->takes_strongest() &&
        has_before(
            call.room.bundle, beam, call.eight, splat(nearest_behind(parts, -1.0f)), kBefore);
    if (!has_missed && !needs_more_sub_rays(echoes, *call.wide.receiver)) return;
  }
}

static bool is_sure(const WideBeams& wide, const Echo& echo) {
  return !is_marginal(wide.receiver->sure_echoes(), *wide.receiver, echo);
}

static ConeConstants constants_of(const KernelMap& map) {
  return {kConeRadius,
          kSolidShare * map.support,
          1.01f * map.support,
          map.weight_scale * kWeightSteps / kWeightOne,
          static_cast<float>(map.tau) * (kWeightSteps / kWeightOne),
          kDepthSteps / map.window,
          map.window / kDepthSteps};
}

}  // namespace pointflight::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
