// Which beams go through the tree together: packets if they lie close, bundles if they lie
// farther apart, single rays if even the way down is hardly shared. However they go, the results
// are the same bits.
//
// Included once a target by Highway's foreach_target; see beam_kernel.cpp.
#if defined(POINTFLIGHT_RENDER_TRACE_INL_HPP) == defined(HWY_TARGET_TOGGLE)
#ifdef POINTFLIGHT_RENDER_TRACE_INL_HPP
#undef POINTFLIGHT_RENDER_TRACE_INL_HPP
#else
#define POINTFLIGHT_RENDER_TRACE_INL_HPP
#endif

#include <algorithm>
#include <memory>

#include "pointflight/render/internal/beam_packets-inl.hpp"
#include "pointflight/render/internal/bundle-inl.hpp"
#include "pointflight/render/internal/grouping-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace pointflight::HWY_NAMESPACE {

/// Where a bundle visits fewer nodes and leaves for each of its beams, it is faster than single
/// rays anywhere.
inline constexpr float kFewVisits = 3.5f;

/// Beams whose origins lie farther apart than so many r are faster by themselves: boxes around all
/// their ways hold too much. Measured at 0.05 and 0.2 m, with origins in cubes of 0.02 to 3.2 m:
/// level at a cube of 3 r, ten to thirty times as slow together at one of 16 r.
inline constexpr float kWidestSpread = 4.0f;

/// Nodes and leaves of a bundle for each of its beams that take as long as a single ray, which
/// visits so many nodes: a fit to scans by four patterns of the hall and the forest at 0.02 and
/// 0.05 m.
POINTFLIGHT_INLINE float visits_worth(float nodes_of_single_ray) {
  return 0.38f * nodes_of_single_ray - 1.0f;
}

/// The beams of groups that were taken, singly.
static std::uint64_t trace_taken(const Beams& beams,
                                 const std::uint32_t* order,
                                 const std::size_t (&taken)[kGroups],
                                 std::size_t groups) {
  std::uint32_t some[kTogether] = {};
  for (std::size_t g = 0; g < groups; ++g) {
    std::copy(order + taken[g], order + taken[g] + 8, some + 8 * g);
  }
  return trace_singly(beams, some, 8 * groups);
}

static std::uint64_t trace_bundles(const Beams& beams,
                                   const std::uint32_t* order,
                                   std::size_t count,
                                   bool always) {
  // 280 KB, too large for the small stacks that some shells and embedding programs give; filled by
  // take_beams and set_up
  thread_local const auto room = std::make_unique_for_overwrite<Bundle>();
  Bundle& bundle = *room;
  const Widths widths{kWidestBundle, kWidestBundle};
  std::uint64_t overflows = 0;
  std::size_t at = 0;
  std::size_t singly = 4 * kTogether;  // that go by themselves if the way is hardly shared
  float worth = -1.0f;                 // visits for each beam, not known yet
  Waiting waiting;
  std::size_t taken[kGroups];
  const auto trace_waiting = [&] {
    overflows += trace_singly(beams, waiting.beams, waiting.count);
    waiting.count = 0;
  };
  while (at + 8 <= count) {
    const std::size_t groups = fill(beams, order, count, widths, at, bundle, taken, waiting);
    if (!waiting.has_room()) trace_waiting();
    if (groups == 0) continue;
    set_up_bundle(beams.map, bundle, groups);
    if (bundle.spread > kWidestSpread * beams.map.r && !always) {
      overflows += trace_taken(beams, order, taken, groups);
      continue;
    }
    walk(beams.map, bundle);
    for (std::size_t n = 0; n < 8 * groups; ++n) {
      const std::uint32_t* beam = order + taken[n / 8] + n % 8;
      if ((bundle.failed >> n & 1u) != 0) {
        overflows += trace_singly(beams, beam, 1);
      } else {
        beams.hits[*beam] = return_of(beams.map, bundle.beams[n].first, bundle.beams[n].hits);
      }
    }
    const float visits = static_cast<float>(bundle.visits) / static_cast<float>(8 * groups);
    if (always || visits <= std::max(kFewVisits, worth)) continue;
    if (worth < 0.0f && at < count) {
      const std::size_t next = std::min(kTogether, count - at);
      std::size_t nodes = 0;
      overflows += trace_singly(beams, order + at, next, nodes);
      at += next;
      worth = visits_worth(static_cast<float>(nodes) / static_cast<float>(next));
      if (visits <= worth) continue;
    }
    const std::size_t next = std::min(singly, count - at);
    overflows += trace_singly(beams, order + at, next);
    at += next;
    singly *= 4;
  }
  trace_waiting();
  return overflows + trace_singly(beams, order + at, count - at);
}

static std::uint64_t trace_packets(const Beams& beams,
                                   const std::uint32_t* order,
                                   std::size_t count,
                                   Packet& packet) {
  const float widest = beams.map.widest_group;
  const Widths widths{widest, 8.0f * widest};
  std::uint64_t overflows = 0;
  std::size_t at = 0;
  Waiting waiting;
  std::size_t taken[kGroups];
  const auto trace_waiting = [&] {
    overflows += trace_bundles(beams, waiting.beams, waiting.count, false);
    waiting.count = 0;
  };
  while (at + 8 <= count) {
    const std::size_t groups = fill(beams, order, count, widths, at, packet, taken, waiting);
    if (!waiting.has_room()) trace_waiting();
    if (groups == 0) continue;
    set_up_packet(beams.map, packet, groups);
    if (packet.spread > kWidestSpread * beams.map.r) {
      overflows += trace_taken(beams, order, taken, groups);
      continue;
    }
    walk(beams.map, packet);
    for (std::size_t g = 0; g < groups; ++g) {
      const std::uint32_t* eight = order + taken[g];
      if ((packet.failed >> g & 1u) != 0) {
        overflows += trace_singly(beams, eight, 8);
      } else {
        finish(beams.map, packet.groups[g], packet.rows[g], eight, beams.hits);
      }
    }
  }
  trace_waiting();
  return overflows + trace_singly(beams, order + at, count - at);
}

/// True if most groups of eight lie close enough together for packets: a look at a few of them.
POINTFLIGHT_INLINE bool is_dense(const Beams& beams,
                                 const std::uint32_t* order,
                                 std::size_t count,
                                 Group& room) {
  constexpr std::size_t kLooks = 8;
  if (count < 8 * kLooks) return true;
  std::size_t together = 0;
  for (std::size_t i = 0; i < kLooks; ++i) {
    const std::size_t at = (count - 8) * i / (kLooks - 1) / 8 * 8;
    const float widest = beams.map.widest_group;
    together += take_beams(beams.rays, order + at, widest, room) ? 1 : 0;
  }
  return 2 * together >= kLooks;
}

static std::uint64_t trace(const KernelMap& map,
                           const MapRay* rays,
                           const std::uint32_t* order,
                           std::size_t count,
                           BeamGrouping grouping,
                           KernelHit* hits) {
  if (map.node_count == 0) {
    for (std::size_t i = 0; i < count; ++i) hits[order[i]] = {};
    return 0;
  }
  const Beams beams{map, rays, hits};
  if (grouping == BeamGrouping::kSingly) return trace_singly(beams, order, count);
  if (grouping == BeamGrouping::kBundles) return trace_bundles(beams, order, count, true);
  // 80 KB, as above
  thread_local const auto packet = std::make_unique_for_overwrite<Packet>();
  return is_dense(beams, order, count, packet->groups[0])
             ? trace_packets(beams, order, count, *packet)
             : trace_bundles(beams, order, count, false);
}

}  // namespace pointflight::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
