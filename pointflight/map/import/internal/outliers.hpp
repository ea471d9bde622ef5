#pragma once

#include <cstdint>
#include <vector>

#include "pointflight/io/cloud_reader.hpp"
#include "pointflight/map/import/internal/cell_tiles.hpp"

namespace pointflight {

/// Statistical outlier removal (the paper, section IV; Rusu et al. 2008) on occupied cells.
struct OutlierOptions {
  bool enabled = true;  ///< False: all cells stay.
  int neighbours = 8;   ///< Cells that a cell is measured by.
  /// A cell goes if its mean distance to its neighbours is above mean + sigmas * deviation of all.
  double sigmas = 4.0;
};

/// What was dropped.
struct Outliers {
  std::vector<CloudPoint> centroids_world;  ///< With the cells' mean intensities.
  std::uint64_t points = 0;                 ///< In the dropped cells.
};

/// Takes the outliers out of the cells: those whose mean distance to the `neighbours` nearest cell
/// centroids is far above that of the cloud. Evenly sparse surfaces stay (ground that a scanner
/// only grazed): a cell also has to stand out from its own neighbours, or be more than ten cells
/// from them. Neighbours farther than 16 cells count as that far. Does not depend on threads.
Outliers drop_outliers(CellTiles& cells,
                       const OutlierOptions& options,
                       const Executor& executor,
                       Scratch& scratch,
                       const Progress& progress = {});

}  // namespace pointflight
