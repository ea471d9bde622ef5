#include "pointflight/scenes/world_map.hpp"

#include <fmt/format.h>

namespace pointflight {

ImportedMap make_world_map(const WorldOptions& options,
                           double resolution,
                           const Executor& executor,
                           const Progress& progress) {
  const ExactScene scene = make_world(options);
  SceneSampling sampling;
  sampling.points_per_cell = 6.0;
  sampling.resolution = resolution;
  sampling.density_min = 0.0;
  sampling.seed = options.seed;
  ImportOptions import;
  import.resolution = resolution;
  import.outliers.enabled = false;  // there are none
  return build_map(
      {fmt::format("world {}, seed {}", options.name, options.seed)},
      [&](std::size_t) { return sampled_cloud(scene, sampling); },
      import,
      executor,
      progress);
}

}  // namespace pointflight
