// What is left to the processor of wide beams that another device has traced.
//
// Included once a target by Highway's foreach_target; see cone_kernel.cpp.
#if defined(POINTFLIGHT_RENDER_CONE_REST_INL_HPP) == defined(HWY_TARGET_TOGGLE)
#ifdef POINTFLIGHT_RENDER_CONE_REST_INL_HPP
#undef POINTFLIGHT_RENDER_CONE_REST_INL_HPP
#else
#define POINTFLIGHT_RENDER_CONE_REST_INL_HPP
#endif

#include <memory>
#include <vector>

#include "pointflight/render/internal/cone-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace pointflight::HWY_NAMESPACE {

static bool second_level_echoes(const SurfelMap& surfels,
                                const WideBeams& wide,
                                const SecondLevel& found,
                                Echoes& echoes) {
  thread_local const auto parts = std::make_unique_for_overwrite<BeamParts>();
  const std::vector<SubRayLanes>& sub_rays = sub_rays_of_level(1, found.direction);
  parts->eights = sub_rays.size();
  parts->sub_rays = sub_rays.data();
  for (std::size_t i = 0; i < SecondLevel::kCount; ++i) {
    SubRayHits& hits = parts->hits[i / 8];
    hits.range[i % 8] = found.ranges[i];
    hits.cosine[i % 8] = found.cosines[i];
    hits.word[i % 8] = static_cast<std::int32_t>(found.words[i]);
  }
  light_up(surfels, wide.receiver->reflectances(), *parts);
  make_echoes(*parts, wide.merge, echoes);
  if (found.has_before && !wide.receiver->takes_strongest()) return false;
  return !needs_more_sub_rays(echoes, *wide.receiver);
}

}  // namespace pointflight::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
