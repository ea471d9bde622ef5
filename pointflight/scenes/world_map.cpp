#include "pointflight/scenes/world_map.hpp"

#include <fmt/format.h>

namespace pointflight {

std::string name_of(const WorldMapOptions& options) {
  std::string name = fmt::format("{}:{}", options.world.name, options.world.seed);
  for (const auto& [parameter, value] : options.world.chosen) {
    name += fmt::format(" {}={}", parameter, value);
  }
  return fmt::format("{} at {} m", name, options.resolution);
}

ImportedMap make_world_map(const WorldMapOptions& options,
                           const Executor& executor,
                           const Progress& progress) {
  const ExactScene scene = make_world(options.world);
  SceneSampling sampling;
  sampling.points_per_cell = 6.0;
  sampling.resolution = options.resolution;
  sampling.density_min = 0.0;
  sampling.seed = options.world.seed;
  ImportOptions import;
  import.resolution = options.resolution;
  import.outliers.enabled = false;  // there are none
  return build_map(
      {fmt::format("world {}, seed {}", options.world.name, options.world.seed)},
      [&](std::size_t) { return sampled_cloud(scene, sampling); },
      import,
      executor,
      progress);
}

std::shared_ptr<const SurfelMap> open_world_map(const WorldMapOptions& options,
                                                const Executor& executor,
                                                const Progress& progress) {
  const ImportedMap made = make_world_map(options, executor, progress);
  return SurfelMap::from_bytes(map_bytes(made.tree, made.description), name_of(options));
}

}  // namespace pointflight
