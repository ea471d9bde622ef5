#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "pointflight/core/parallel.hpp"
#include "pointflight/geometry/types.hpp"
#include "pointflight/render/internal/map_ray.hpp"

namespace pointflight {

/// Indices of the rays so that neighbours in the list point the same way: along a Hilbert curve
/// over the sphere (octahedral map) with cells of about 0.05 degrees; equal cells keep their order.
/// Beams traced in this order find their part of the map in the cache.
std::vector<std::uint32_t> direction_order(std::span<const Ray> rays, const Executor& executor);

/// The same of rays in a map.
std::vector<std::uint32_t> direction_order(std::span<const MapRay> rays, const Executor& executor);

/// The same for directions in any frame: a turned pattern keeps its neighbours.
std::vector<std::uint32_t> direction_order(std::span<const Vector3f> directions,
                                           const Executor& executor);

}  // namespace pointflight
