#pragma once

#include <cstdint>
#include <functional>
#include <span>

#include "pointflight/render/internal/beam_kernel.hpp"

namespace pointflight {

/// A surfel that a ray passes within its support.
struct SurfelHit {
  float t;              ///< Where the ray is closest to it in the surfel's own metric, m.
  std::int32_t weight;  ///< By the hit rule, in steps of kWeightOne.
  std::uint32_t word;   ///< Index in `SurfelMap::words()`.
};

/// Everything along one ray, by the hit rule.
struct RayHits {
  std::uint32_t ray;                ///< Index in `rays`.
  float first;                      ///< Where the surface begins; negative if there is none.
  float range;                      ///< What would be rendered, m; negative if nothing.
  std::span<const SurfelHit> hits;  ///< Up to its range_max, in no order.
};

/// Follows the rays `order[0..]` through everything, up to their range_max, and calls `visit` for
/// each, in no order. Hits and ranges are the same bits on all processors. If a ray
/// hits more surfels than fit in its list, the farther half is dropped and the ray ends there;
/// returns how often.
std::uint64_t find_all_hits(const KernelMap& map,
                            std::span<const MapRay> rays,
                            std::span<const std::uint32_t> order,
                            const std::function<void(const RayHits&)>& visit);

}  // namespace pointflight
