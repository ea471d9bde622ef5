// Rays that go through everything: what a map's fit to its survey asks.
#include "pointflight/render/internal/all_hits_kernel.hpp"

#include "pointflight/core/internal/simd_targets-inl.hpp"
// for foreach_target
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pointflight/render/internal/all_hits_kernel.cpp"
#include <hwy/foreach_target.h>
// after foreach_target
#include "pointflight/render/internal/beam_kernel-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace pointflight::HWY_NAMESPACE {

static std::uint64_t follow(const KernelMap& map,
                            const MapRay* rays,
                            const std::uint32_t* order,
                            std::size_t count,
                            const std::function<void(const RayHits&)>& visit) {
  SurfelHit met[kHits + 16];
  if (map.node_count == 0) {
    for (std::size_t i = 0; i < count; ++i) visit({order[i], -1.0f, -1.0f, {}});
    return 0;
  }
  return follow_singly<HitMode::kAll>(map, rays, order, count, [&](RayState& s) {
    for (std::size_t i = 0; i < s.hits.count; ++i) {
      met[i] = {s.hits.t[i], s.hits.weight[i], static_cast<std::uint32_t>(s.hits.word[i])};
    }
    const float first = s.hits.total >= map.tau ? find_surface(map, s.hits) : kNever;
    visit({s.ray,
           first == kNever ? -1.0f : first,
           return_of(map, first, s.hits).range,
           {met, s.hits.count}});
  });
}

}  // namespace pointflight::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace pointflight {
namespace {

HWY_EXPORT(follow);

}  // namespace

std::uint64_t find_all_hits(const KernelMap& map,
                            std::span<const MapRay> rays,
                            std::span<const std::uint32_t> order,
                            const std::function<void(const RayHits&)>& visit) {
  return HWY_DYNAMIC_DISPATCH(follow)(map, rays.data(), order.data(), order.size(), visit);
}

}  // namespace pointflight
#endif  // HWY_ONCE
