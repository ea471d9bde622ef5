// Beams one by one, and how neighbours in a call's order are taken into groups that go together.
//
// Included once a target by Highway's foreach_target; see beam_kernel.cpp and cone_kernel.cpp.
#if defined(POINTFLIGHT_RENDER_GROUPING_INL_HPP) == defined(HWY_TARGET_TOGGLE)
#ifdef POINTFLIGHT_RENDER_GROUPING_INL_HPP
#undef POINTFLIGHT_RENDER_GROUPING_INL_HPP
#else
#define POINTFLIGHT_RENDER_GROUPING_INL_HPP
#endif

#include "pointflight/render/internal/beam_groups-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace pointflight::HWY_NAMESPACE {

/// Beams farther apart than this (rad) do not go together.
inline constexpr float kWidestBundle = 0.4f;

/// Beams of one call, and where to write what they hit.
struct Beams {
  const KernelMap& map;
  const MapRay* rays;
  KernelHit* hits;
};

/// The hits of single rays. Returns how many lists overflowed; adds to the nodes visited.
static std::uint64_t trace_singly(const Beams& beams,
                                  const std::uint32_t* order,
                                  std::size_t count,
                                  std::size_t& nodes) {
  const std::size_t steps = most_steps(beams.map);
  const auto finish = [&](RayState& s) {
    beams.hits[s.ray] = return_of(beams.map, s.first, s.hits);
    nodes += steps - s.steps;
  };
  return follow_singly<HitMode::kFirst>(beams.map, beams.rays, order, count, finish);
}

static std::uint64_t trace_singly(const Beams& beams,
                                  const std::uint32_t* order,
                                  std::size_t count) {
  std::size_t nodes = 0;
  return trace_singly(beams, order, count, nodes);
}

/// Beams that wait for another way to go.
struct Waiting {
  std::uint32_t beams[256] = {};
  std::size_t count = 0;

  [[nodiscard]] bool has_room() const { return count + 8 <= std::size(beams); }
  void add(const std::uint32_t* eight) {
    std::copy(eight, eight + 8, beams + count);
    count += 8;
  }
};

/// How wide groups of eight beams may be, and how far apart those that go together, rad.
struct Widths {
  float group, together;
};

/// Takes groups of eight beams from `at` on, as far as they lie together; `taken` tells where each
/// begins. Groups that are too wide go to those that wait. Returns the number of groups.
POINTFLIGHT_INLINE std::size_t fill(const Beams& beams,
                                    const std::uint32_t* order,
                                    std::size_t count,
                                    const Widths& widths,
                                    std::size_t& at,
                                    BeamGroups& p,
                                    std::size_t (&taken)[kGroups],
                                    Waiting& waiting) {
  std::size_t groups = 0;
  while (groups < kGroups && at + 8 <= count && waiting.has_room()) {
    // beams lie scattered: the next ones are fetched meanwhile
    for (std::size_t i = at + kTogether; i < std::min(at + kTogether + 8, count); ++i) {
      hwy::Prefetch(beams.rays + order[i]);
    }
    const bool close = take_beams(beams.rays, order + at, widths.group, p.groups[groups]);
    if (close && groups > 0 && !lies_near(p.groups[groups], p.groups[0], widths.together)) break;
    if (close) {
      taken[groups++] = at;
    } else {
      waiting.add(order + at);
    }
    at += 8;
  }
  return groups;
}

}  // namespace pointflight::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
