#pragma once

#include <cstdint>
#include <span>

#include "pointflight/map/surfel_map.hpp"
#include "pointflight/render/internal/beam_kernel.hpp"
#include "pointflight/render/wide_beams.hpp"

namespace pointflight {

/// Beams wider than this (radius, rad) are no cones: across them, directions are not parallel.
inline constexpr float kWidestCone = 0.1f;

/// Finds the echoes of the wide beams `order[0..]` in a map, with as many sub-rays as it takes
/// (docs/architecture.md, "Wide beams"). The results are the same bits on all instruction sets,
/// whatever the order and whatever else is traced in the same call, but for beams that touch more
/// than 1,000 surfels.
void trace_cones(const SurfelMap& surfels,
                 const KernelMap& map,
                 std::span<const MapRay> rays,
                 std::span<const std::uint32_t> order,
                 const WideBeams& wide);

/// True if more sub-rays may change which echoes are reported: few of them hit one that is on the
/// verge of being reported.
[[nodiscard]] bool needs_more_sub_rays(const Echoes& echoes, const EchoReceiver& receiver);

}  // namespace pointflight
