#pragma once

#include <span>

#include "pointflight/core/parallel.hpp"
#include "pointflight/core/time.hpp"
#include "pointflight/geometry/types.hpp"
#include "pointflight/map/body.hpp"
#include "pointflight/render/hit.hpp"
#include "pointflight/render/renderer.hpp"

namespace pointflight {

/// Renders rays that start anywhere; `hits` has their length. A batch is laid out for a sensor,
/// whose rays go the same way if they point the same way. These are sorted by where they start
/// first and then by where they point, so that neighbours in the order go down the hierarchy
/// together, if they start within a few cells of each other. Not for renderers of images
/// (`Renderer::is_snapshot`): std::invalid_argument. `bodies` are where they are at `time`.
void cast_rays(const Renderer& renderer,
               std::span<const Ray> rays,
               std::span<Hit> hits,
               const Executor& executor,
               std::span<const Body> bodies = {},
               SimTime time = {});

}  // namespace pointflight
