#pragma once

#include <cstdint>
#include <vector>

#include "pointflight/core/parallel.hpp"
#include "pointflight/map/voxel_moments.hpp"

namespace pointflight {

/// Statistical outlier removal (the paper, section IV; Rusu et al. 2008) on occupied cells.
struct OutlierOptions {
  bool enabled = true;
  int neighbours = 8;
  /// A cell goes if its mean distance to its neighbours is above mean + sigmas * deviation of all.
  double sigmas = 4.0;
};

/// Indices of the cells that are outliers, ascending: those whose mean distance to the `neighbours`
/// nearest cell centroids is far above that of the cloud. Evenly sparse surfaces stay (ground that
/// a scanner only grazed): a cell also has to stand out from its own neighbours, or be more than
/// ten cells from them. Does not depend on threads.
std::vector<std::uint32_t> find_outliers(const VoxelGrid& grid,
                                         const OutlierOptions& options,
                                         const Executor& executor);

}  // namespace pointflight
