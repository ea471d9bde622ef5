#pragma once

#include <vector>

#include "pointflight/map/sparse_blocks.hpp"
#include "pointflight/map/surfel_piece.hpp"

namespace pointflight {

/// The same points in cells twice as wide.
CellTiles wider_cells(const CellTiles& cells, const Executor& executor, Scratch& scratch);

/// Wide cells instead of thin ones: where a cell two to eight times as wide, up to 0.45 m, is
/// planar with 4 points or more and the cells half as wide in it have fewer than 3 on average, in
/// sparse blocks. Sets `covered` for the cells that lie in one (by their number). The pieces come
/// in Morton order. Does not depend on threads.
ScratchArray<SurfelPiece> surfels_of_wide_cells(const CellTiles& cells,
                                                const SparseBlocks& sparse,
                                                std::vector<bool>& covered,
                                                const Executor& executor,
                                                Scratch& scratch,
                                                const Progress& progress = {});

}  // namespace pointflight
