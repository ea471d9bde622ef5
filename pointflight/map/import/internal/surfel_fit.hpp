#pragma once

#include "pointflight/map/bvh8.hpp"
#include "pointflight/map/import/internal/cell_tiles.hpp"

namespace pointflight {

/// Fits a surfel to a cell of the grid that `window` looks at; its centre is in voxels from the
/// cell's low corner. Axes come from the 3x3x3 neighbourhood if that is planar, spreads from the
/// cell's own points, shrunk to a prior worth 8 points (docs/architecture.md, "Surfels").
Surfel fit_surfel(const VoxelGrid& grid, NeighbourWindow& window, const VoxelCell& cell);

/// True for a cell amid a plane: its points lie within `thickness` (m, one standard deviation) of
/// one, those of the cells around within 0.05 of a cell's width, and it goes on to all sides.
bool lies_amid_plane(const VoxelGrid& grid,
                     NeighbourWindow& window,
                     const VoxelCell& cell,
                     double thickness);

/// Fits one surfel to each cell, in the cells' order.
ScratchArray<BuildSurfel> fit_surfels(const CellTiles& cells,
                                      const Executor& executor,
                                      Scratch& scratch,
                                      const Progress& progress = {});

}  // namespace pointflight
