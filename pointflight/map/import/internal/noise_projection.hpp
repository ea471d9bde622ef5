#pragma once

#include <cstdint>

#include "pointflight/map/import/internal/cell_tiles.hpp"

namespace pointflight {

/// Standard deviation of the cloud's points across its flat surfaces, m: the 20th percentile of the
/// thickness of planar neighbourhoods. 0 if there are none (foliage).
double estimate_noise(const CellTiles& cells, const Executor& executor);

/// What the projection did.
struct ProjectionReport {
  std::uint64_t kept = 0;       ///< Cells that are thin themselves.
  std::uint64_t projected = 0;  ///< Cells moved onto a plane.
  std::uint64_t too_thick =
      0;  ///< Left alone: planar, but thicker than noise explains (two faces).
};

/// True if a noise of `sigma` is worth a projection: above 0.05 of a cell. On cleaner clouds it
/// does more harm than good.
bool needs_projection(const CellTiles& cells, double sigma);

/// The cells moved along the normal onto the plane of the smallest neighbourhood (3, 5 or 7 cells
/// wide) that is planar, and flattened; cells that land in one merge. A plane must not be thicker
/// than max(2.5 sigma, 20 mm, 0.35 r): the faces of a partition stay apart. Does not depend on
/// threads.
CellTiles project_noise(const CellTiles& cells,
                        double sigma,
                        const Executor& executor,
                        Scratch& scratch,
                        ProjectionReport& report,
                        const Progress& progress = {});

}  // namespace pointflight
