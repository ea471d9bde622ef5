#pragma once

#include "pointflight/core/parallel.hpp"
#include "pointflight/core/progress.hpp"
#include "pointflight/map/import/map_builder.hpp"
#include "pointflight/scenes/made_world.hpp"

namespace pointflight {

/// A world and the resolution of its map.
struct WorldMapOptions {
  WorldOptions world;       ///< Which.
  double resolution = 0.1;  ///< m
};

/// "street:7 at 0.1 m", with the parameters that were chosen.
std::string name_of(const WorldMapOptions& options);

/// The map of a perfect scan of a world: its surfaces are sampled evenly, six points a square of
/// the resolution, without noise. Glass is not there. The same options and resolution are the
/// same bytes. Throws InputError as `make_world` does.
ImportedMap make_world_map(const WorldMapOptions& options,
                           const Executor& executor,
                           const Progress& progress = {});

/// The same in memory.
std::shared_ptr<const SurfelMap> open_world_map(const WorldMapOptions& options,
                                                const Executor& executor,
                                                const Progress& progress = {});

}  // namespace pointflight
