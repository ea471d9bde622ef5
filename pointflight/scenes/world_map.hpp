#pragma once

#include "pointflight/core/parallel.hpp"
#include "pointflight/core/progress.hpp"
#include "pointflight/map/import/map_builder.hpp"
#include "pointflight/scenes/made_world.hpp"

namespace pointflight {

/// The map of a perfect scan of a world: its surfaces are sampled evenly, six points a square of
/// the resolution (m), without noise. Glass is not there. The same options and resolution are the
/// same bytes. Throws InputError as `make_world` does.
ImportedMap make_world_map(const WorldOptions& options,
                           double resolution,
                           const Executor& executor,
                           const Progress& progress = {});

}  // namespace pointflight
