#pragma once

#include <vector>

#include "pointflight/map/import/internal/sparse_blocks.hpp"
#include "pointflight/map/import/internal/surfel_piece.hpp"

namespace pointflight {

/// The same points in cells twice as wide.
CellTiles wider_cells(const CellTiles& cells, const Executor& executor, Scratch& scratch);

/// Surfels of wide cells.
struct WideSurfels {
  ScratchArray<SurfelPiece> pieces;  ///< In Morton order.
  std::vector<bool> covered;         ///< The cells that lie in one, by their number.
  std::size_t thin = 0;              ///< How many stand for thin cells.
  std::size_t merged = 0;            ///< How many for cells amid a plane.
};

/// Wide cells instead of several narrow ones. In sparse blocks, if points are thin: a cell two
/// to eight times as wide, up to 0.45 m, that is planar with 4 points or more, if the cells half
/// as wide in it have fewer than 3.5 on average. Elsewhere amid planes: a cell twice as wide whose
/// points lie within 0.005 r of one plane, or a quarter of `noise` (m, of the points across flat
/// surfaces), but 0.02 r at most, if the surface goes on to all sides. `surfels` are those of
/// `cells`, in their order. Does not depend on threads.
WideSurfels surfels_of_wide_cells(const CellTiles& cells,
                                  const ScratchArray<BuildSurfel>& surfels,
                                  const SparseBlocks& sparse,
                                  double noise,
                                  const Executor& executor,
                                  Scratch& scratch,
                                  const Progress& progress = {});

}  // namespace pointflight
