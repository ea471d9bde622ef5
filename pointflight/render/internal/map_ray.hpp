#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "pointflight/core/parallel.hpp"
#include "pointflight/render/internal/grid_origin.hpp"
#include "pointflight/render/renderer.hpp"

namespace pointflight {

struct KernelMap;

/// A ray as a map's kernels take it, on processors and GPUs: from a voxel of its grid and the rest.
struct MapRay {
  std::int32_t voxel[3];  ///< `GridOrigin`s, by axis.
  float rest[3];          ///< m; not always within the voxel.
  float direction[3];     ///< Unit vector.
  float range_max;        ///< m

  [[nodiscard]] GridOrigin origin(int axis) const { return {voxel[axis], rest[axis]}; }
};

[[nodiscard]] MapRay map_ray(const KernelMap& map, const Ray& ray);
[[nodiscard]] std::vector<MapRay> map_rays(const KernelMap& map, std::span<const Ray> rays);

/// Ray `i` of a batch.
[[nodiscard]] MapRay map_ray(const KernelMap& map, const RayBatch& batch, std::size_t i);
/// All of a batch.
[[nodiscard]] std::vector<MapRay> map_rays(const KernelMap& map,
                                           const RayBatch& batch,
                                           const Executor& executor);

/// Where the sensor of aimed beams is, by axis: their rays are from the same voxel, with this rest
/// and their shift.
struct MapPosition {
  GridOrigin axis[3];
};
[[nodiscard]] MapPosition map_position(const KernelMap& map, const AimedBeams& aimed);

}  // namespace pointflight
