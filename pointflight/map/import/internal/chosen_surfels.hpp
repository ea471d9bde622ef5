#pragma once

#include <cstdint>
#include <vector>

#include "pointflight/map/import/internal/cell_tiles.hpp"
#include "pointflight/map/import/internal/surfel_piece.hpp"
#include "pointflight/map/intensity_levels.hpp"

namespace pointflight {

/// What goes into a map's tree.
struct ChosenSurfels {
  ScratchArray<BuildSurfel> surfels;     ///< In Morton order, at most eight at a voxel.
  ScratchArray<std::uint8_t> intensity;  ///< Codes beside them; empty without intensities.
  IntensityLevels levels;                ///< Of the codes.
  std::uint64_t planar = 0;              ///< Of thickness class 0.
  double points_per_planar = 0.0;        ///< Median of the points that each of those stands for.
};

/// Puts together the surfels of the cells that are neither covered by a wide one nor split, the
/// wide ones and the small ones.
ChosenSurfels choose_surfels(const CellTiles& cells,
                             const ScratchArray<BuildSurfel>& of_cells,
                             const std::vector<bool>& covered,
                             const ScratchArray<SurfelPiece>& wide,
                             const ScratchArray<SurfelPiece>& small,
                             bool has_intensity,
                             Scratch& scratch);

}  // namespace pointflight
