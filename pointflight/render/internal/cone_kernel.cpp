// Compiles the kernel of wide beams once for each instruction set and picks one at run time.
#include "pointflight/render/internal/cone_kernel.hpp"

#include "pointflight/core/internal/simd_targets-inl.hpp"
// for foreach_target
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pointflight/render/internal/cone_kernel.cpp"
#include <hwy/foreach_target.h>
// after foreach_target
#include "pointflight/render/internal/cone_call-inl.hpp"
#include "pointflight/render/internal/cone_rest-inl.hpp"

#if HWY_ONCE
namespace pointflight {
namespace {

HWY_EXPORT(trace_wide);
HWY_EXPORT(constants_of);
HWY_EXPORT(second_level_echoes);
HWY_EXPORT(is_sure);

constexpr std::size_t kFew = 8;  // sub-rays

/// By how much the share of light of an echo may be off, as a part of itself: two sub-rays more or
/// less are chance.
double uncertainty_of(const Echo& echo) {
  return 2.0 / static_cast<double>(echo.parts);
}

/// The energy below which an echo is not reported, whatever its sub-rays: if one counts, the
/// strongest.
double energy_that_counts(const Echoes& echoes, const EchoReceiver& receiver) {
  double least = 0.0;
  if (!receiver.takes_strongest()) return least;
  for (const Echo& echo : echoes.span()) {
    least = std::max(least, std::max(0.0, 1.0 - uncertainty_of(echo)) * energy_of(echo));
  }
  return least;
}

}  // namespace

ConeConstants cone_constants(const KernelMap& map) {
  return HWY_DYNAMIC_DISPATCH(constants_of)(map);
}

bool find_second_level_echoes(const SurfelMap& surfels,
                              const WideBeams& wide,
                              const SecondLevel& hits,
                              Echoes& echoes) {
  return HWY_DYNAMIC_DISPATCH(second_level_echoes)(surfels, wide, hits, echoes);
}

bool is_sure_of(const WideBeams& wide, const Echo& echo) {
  return HWY_DYNAMIC_DISPATCH(is_sure)(wide, echo);
}

bool needs_more_sub_rays(const Echoes& echoes, const EchoReceiver& receiver) {
  const double counts = energy_that_counts(echoes, receiver);
  for (const Echo& echo : echoes.span()) {
    if (echo.parts > kFew) continue;
    const double chance = uncertainty_of(echo);
    if ((1.0 + chance) * energy_of(echo) < counts) continue;
    if (receiver.is_marginal(echo, std::max(0.0, 1.0 - chance), 1.0 + chance)) return true;
  }
  return false;
}

void trace_cones(const SurfelMap& surfels,
                 const KernelMap& map,
                 std::span<const MapRay> rays,
                 std::span<const std::uint32_t> order,
                 const WideBeams& wide) {
  if (map.node_count == 0) {
    for (const std::uint32_t i : order) wide.echoes[i] = {};
    return;
  }
  HWY_DYNAMIC_DISPATCH(trace_wide)(map, surfels, rays.data(), order.data(), order.size(), wide);
}

}  // namespace pointflight
#endif  // HWY_ONCE
