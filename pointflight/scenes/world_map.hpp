#pragma once

#include <memory>
#include <optional>
#include <string>

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
/// the resolution, without noise; intensities are reflectivities in percent. It says what its
/// surfels are parts of and which beams they let through (`note_surfaces`), and which world it is
/// of
/// (`world_of`). The same options and resolution are the same bytes. Throws InputError as
/// `make_world` does.
ImportedMap make_world_map(const WorldMapOptions& options,
                           const Executor& executor,
                           const Progress& progress = {});

/// The same in memory.
std::shared_ptr<const SurfelMap> open_world_map(const WorldMapOptions& options,
                                                const Executor& executor,
                                                const Progress& progress = {});

/// Says in a map's metadata which world it is of.
void set_world(MapDescription& description, const WorldMapOptions& options);
/// The world that a map is of, as its metadata say; nothing if they do not.
std::optional<WorldMapOptions> world_of(const SurfelMap& map);

/// What is known of a world, as JSON: kind, seed, parameters, classes with their numbers in
/// ADE20K, and each thing's number, class, reflectivity and box (m).
std::string world_truth(const WorldMapOptions& options, const ExactScene& scene);

}  // namespace pointflight
