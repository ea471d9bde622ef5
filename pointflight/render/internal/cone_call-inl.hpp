// The wide beams of a call: which of them go together.
//
// Included once a target by Highway's foreach_target; see cone_kernel.cpp.
#if defined(POINTFLIGHT_RENDER_CONE_CALL_INL_HPP) == defined(HWY_TARGET_TOGGLE)
#ifdef POINTFLIGHT_RENDER_CONE_CALL_INL_HPP
#undef POINTFLIGHT_RENDER_CONE_CALL_INL_HPP
#else
#define POINTFLIGHT_RENDER_CONE_CALL_INL_HPP
#endif

#include <memory>
#include <span>

#include "pointflight/render/internal/cone-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace pointflight::HWY_NAMESPACE {

/// Beams of a bundle that look along one axis of the map.
struct AlikeBeams {  // NOLINT(cppcoreguidelines-pro-type-member-init): written before it is read
  MapAxis axis;
  std::uint32_t beams[kTogether];
  std::size_t count = 0;
};

/// Calls `run(groups, rays of each, a bit for each beam)` for the beams of a bundle, whose groups
/// hold them then, by the axes of the map that they look along: mostly once.
template <class Run>
POINTFLIGHT_INLINE void run_by_axes(const MapRay* rays,
                                    std::size_t groups,
                                    const std::uint32_t* const* of_groups,
                                    ConeBundle& bundle,
                                    const Run& run) {
  if (groups == 0) return;
  AlikeBeams alike[6];
  std::size_t axes = 0;
  for (std::size_t n = 0; n < 8 * groups; ++n) {
    const std::uint32_t i = of_groups[n / 8][n % 8];
    const MapAxis axis = axis_of(rays[i].direction);
    std::size_t k = 0;
    while (k < axes && alike[k].axis != axis) ++k;
    if (k == axes) alike[axes++].axis = axis;
    alike[k].beams[alike[k].count++] = i;
  }
  if (axes == 1) {
    run(groups, of_groups, ~std::uint64_t{0} >> (64 - 8 * groups));
    return;
  }
  for (std::size_t k = 0; k < axes; ++k) {
    AlikeBeams& some = alike[k];
    const std::size_t count = some.count;
    // the last group is filled up with one of them
    while (some.count % 8 != 0) some.beams[some.count++] = some.beams[0];
    const std::uint32_t* eights[kGroups];
    for (std::size_t g = 0; g < some.count / 8; ++g) {
      eights[g] = some.beams + 8 * g;
      take_beams(rays, eights[g], kWidestBundle, bundle.groups[g]);
    }
    run(some.count / 8, eights, ~std::uint64_t{0} >> (64 - count));
  }
}

static void trace_wide(const KernelMap& map,
                       const SurfelMap& surfels,
                       const MapRay* rays,
                       const std::uint32_t* order,
                       std::size_t count,
                       const WideBeams& wide) {
  // some MB, too large for stacks; filled as it is needed
  thread_local const auto room = std::make_unique_for_overwrite<ConeRoom>();
  ConeBundle& bundle = room->bundle;
  const ConeCall call{map,
                      surfels,
                      rays,
                      wide,
                      wide.receiver->reflectances(),
                      wide.receiver->sure_echoes(),
                      first_sub_rays(),
                      *room};
  const Beams beams{map, rays, nullptr};
  const Widths widths{kWidestBundle, kWidestBundle};
  const auto run_alone = [&](std::span<const std::uint32_t> some) {
    for (const std::uint32_t i : some) {
      const std::uint32_t eight[8] = {i, i, i, i, i, i, i, i};
      take_beams(rays, eight, kWidestBundle, bundle.groups[0]);
      const std::uint32_t* const of_group = eight;
      set_up_cones(map, wide, bundle, 1, &of_group, kMostAlone);
      walk(call, 1);
      finish(call, bundle.beams[0]);
    }
  };
  const auto run =
      [&](std::size_t groups, const std::uint32_t* const* of_groups, std::uint64_t all) {
        set_up_cones(map, wide, bundle, groups, of_groups, kMostTogether);
        walk(call, all);
        std::uint32_t crowded[kTogether];  // more surfels than there is room for here
        std::size_t crowds = 0;
        for (; all != 0; all &= all - 1) {
          ConeBeam& beam = bundle.beams[std::countr_zero(all)];
          if (beam.failed) {
            crowded[crowds++] = beam.ray;
          } else {
            finish(call, beam);
          }
        }
        run_alone({crowded, crowds});
      };
  std::size_t at = 0;
  Waiting waiting;
  std::size_t taken[kGroups];
  while (at + 8 <= count) {
    const std::size_t groups = fill(beams, order, count, widths, at, bundle, taken, waiting);
    const std::uint32_t* of_groups[kGroups];
    for (std::size_t g = 0; g < groups; ++g) of_groups[g] = order + taken[g];
    run_by_axes(rays, groups, of_groups, bundle, run);
    run_alone({waiting.beams, waiting.count});
    waiting.count = 0;
  }
  run_alone({order + at, count - at});
}

}  // namespace pointflight::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
