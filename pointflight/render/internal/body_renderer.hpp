#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "pointflight/core/parallel.hpp"
#include "pointflight/render/renderer.hpp"

namespace pointflight {

/// Rays against the batch's bodies, each body where it is at the ray's own time: exact shapes
/// exactly, bodies of points by the same surfel rule as the map. A hit that a body is nearer than
/// becomes the body's. Of bodies at one range the first in the list counts.
void render_bodies(const RayBatch& batch, std::span<Hit> hits, const Executor& executor);

/// Numbers of the batch's rays that bodies may hit, or pass by no farther than `widest` (rad), in
/// an order that has neighbours together.
std::vector<std::uint32_t> rays_near_bodies(const RayBatch& batch,
                                            float widest,
                                            const Executor& executor);

}  // namespace pointflight
