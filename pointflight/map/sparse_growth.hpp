#pragma once

#include <cstdint>

#include "pointflight/map/bvh8.hpp"
#include "pointflight/map/cell_tiles.hpp"

namespace pointflight {

/// Widens the surfels of thinly scanned surfaces until neighbours touch, so that a wall with a
/// point every other cell stays a wall. Works where a block of 3 m has fewer than 4 points in its
/// median planar cell, on cells with fewer than 4 points whose wider neighbourhood is planar; dense
/// regions and foliage are left as they are. Returns how many surfels were widened.
///
/// `surfels` are those of `cells`, in their order. Does not depend on threads.
std::uint64_t grow_sparse_surfels(const CellTiles& cells,
                                  const ScratchArray<BuildSurfel>& surfels,
                                  const Executor& executor,
                                  const Progress& progress = {});

}  // namespace pointflight
