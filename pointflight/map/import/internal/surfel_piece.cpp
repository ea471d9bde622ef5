#include "pointflight/map/import/internal/surfel_piece.hpp"

#include <algorithm>
#include <cmath>

namespace pointflight {
namespace {

constexpr float kLeastVolume = 0.035f;  // r: s0 that is not rounded to a planar surfel's
constexpr float kWidestSpread = 1.8f;   // r

}  // namespace

float mean_intensity(const VoxelCell& cell) {
  const float mean = cell.intensity_sum / static_cast<float>(cell.n);
  return std::isfinite(mean) ? mean : 0.0f;
}

BuildSurfel rescaled(SurfelWord word,
                     float factor,
                     const VoxelFrame& map,
                     const Vector3d& center,
                     const std::array<std::int32_t, 3>& voxel) {
  Surfel surfel = decode(word);
  const bool planar = is_planar(word);
  surfel.s *= factor;
  surfel.s[0] = planar ? kPlanarThickness : std::max(surfel.s[0], kLeastVolume);
  for (const int k : {1, 2}) surfel.s[k] = std::clamp(surfel.s[k], kMinSpread, kWidestSpread);
  const Vector3d at = (center - map.base_world) / map.resolution;
  for (int axis = 0; axis < 3; ++axis) {
    const double low = voxel[static_cast<std::size_t>(axis)];
    surfel.center_voxels[axis] = std::clamp(static_cast<float>(at[axis] - low), 0.0f, 0.999f);
  }
  return {voxel_key(voxel), encode(surfel)};
}

}  // namespace pointflight
