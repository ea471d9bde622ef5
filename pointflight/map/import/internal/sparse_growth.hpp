#pragma once

#include <cstdint>
#include <vector>

#include "pointflight/map/bvh8.hpp"
#include "pointflight/map/import/internal/cell_tiles.hpp"
#include "pointflight/map/import/internal/sparse_blocks.hpp"

namespace pointflight {

/// Widens the surfels of thinly scanned surfaces until neighbours touch, so that a wall with a
/// point every other cell stays a wall. Works in sparse blocks, on cells with fewer than 4 points
/// whose wider neighbourhood is planar; dense regions and foliage are left as they are. Returns how
/// many surfels were widened.
///
/// `surfels` are those of `cells`, in their order; those that are `covered` by a wide one (empty:
/// none) are left as they are. Does not depend on threads.
std::uint64_t grow_sparse_surfels(const CellTiles& cells,
                                  const ScratchArray<BuildSurfel>& surfels,
                                  const std::vector<bool>& covered,
                                  const SparseBlocks& blocks,
                                  const Executor& executor,
                                  const Progress& progress = {});

}  // namespace pointflight
