#pragma once

#include <vector>

#include "pointflight/core/parallel.hpp"
#include "pointflight/map/bvh8.hpp"
#include "pointflight/map/voxel_moments.hpp"

namespace pointflight {

/// Fits one surfel to each cell of the grid, in the grid's order, which must be Morton order of
/// `voxel - min_voxel`. Axes come from the 3x3x3 neighbourhood where that is planar, spreads from
/// the cell's own points, shrunk to a prior worth 8 points (docs/architecture.md, "Surfels").
std::vector<BuildSurfel> fit_surfels(const VoxelGrid& grid,
                                     const std::array<std::int32_t, 3>& min_voxel,
                                     const Executor& executor);

}  // namespace pointflight
