#pragma once

#include <cstdint>
#include <functional>
#include <span>

#include "pointflight/render/internal/beam_kernel.hpp"

namespace pointflight {

/// A surfel that a ray passes within its support.
struct MetSurfel {
  float t;              ///< Where the ray passes it closest in its own measure, m.
  std::int32_t weight;  ///< By the hit rule, in steps of kWeightOne.
  std::uint32_t word;   ///< Index in `SurfelMap::words()`.
};

/// Everything along one ray, by the hit rule.
struct RayMeetings {
  std::uint32_t ray;               ///< Index in `rays`.
  float first;                     ///< Where the surface begins; negative where there is none.
  float range;                     ///< What would be rendered, m; negative where nothing.
  std::span<const MetSurfel> met;  ///< Up to its range_max, in no order.
};

/// Follows the rays `order[0..]` through everything, up to their range_max, and calls `visit` for
/// each, in no order. What is met and rendered is the same bits on all processors. Where a ray
/// meets more surfels than fit in its list, the farther half goes and the ray ends there; returns
/// how often.
std::uint64_t meet_all(const KernelMap& map,
                       std::span<const Ray> rays,
                       std::span<const std::uint32_t> order,
                       const std::function<void(const RayMeetings&)>& visit);

}  // namespace pointflight
