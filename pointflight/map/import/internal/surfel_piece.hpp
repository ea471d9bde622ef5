// One width of cells does not suit a whole map: if points are thin on a flat surface a wide cell
// holds enough of them (wide_cells), and where many lie on something that is not flat small cells
// show its form (small_cells).
#pragma once

#include <array>
#include <cstdint>

#include "pointflight/map/bvh8.hpp"
#include "pointflight/map/internal/voxel_moments.hpp"

namespace pointflight {

/// A surfel that stands for a wide or a small cell.
struct SurfelPiece {
  BuildSurfel surfel;           ///< By the map's own voxels.
  std::uint32_t n = 0;          ///< Points.
  float mean_intensity = 0.0f;  ///< Of the points.
};

/// Mean intensity of a cell's points; 0 if it is not finite.
float mean_intensity(const VoxelCell& cell);

/// The cell twice as wide that a cell lies in.
inline std::array<std::int32_t, 3> wider_voxel(const std::array<std::int32_t, 3>& voxel) {
  return {voxel[0] >> 1, voxel[1] >> 1, voxel[2] >> 1};
}

/// The surfel of a cell `factor` times as wide as the map's, in the map's unit and in a voxel of
/// the map; `center`: of the cell's points, world, m.
BuildSurfel rescaled(SurfelWord word,
                     float factor,
                     const VoxelFrame& map,
                     const Vector3d& center,
                     const std::array<std::int32_t, 3>& voxel);

}  // namespace pointflight
