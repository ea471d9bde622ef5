// What is in a sensor's way, found by what real scans lack of what a map says they should have.
#pragma once

#include <cstddef>
#include <vector>

#include "pointflight/core/parallel.hpp"
#include "pointflight/core/progress.hpp"
#include "pointflight/fidelity/scan_comparison.hpp"
#include "pointflight/lidar/blockage.hpp"
#include "pointflight/lidar/lidar_settings.hpp"
#include "pointflight/lidar/return_model.hpp"
#include "pointflight/render/renderer.hpp"

namespace pointflight {

/// The result of `fit_blockage`.
struct BlockageFit {
  std::size_t scans = 0;               ///< Looked at.
  std::vector<BlockedSector> sectors;  ///< Where something is in the way, and how much.
  double told = 0.0;       ///< Share of the sensor's beams in whose direction scans tell it.
  double blocked = 0.0;    ///< Share of the beams that is lost to it, on average.
  double returns = 0.0;    ///< Share of the beams that came back in the real scans.
  double modelled = 0.0;   ///< The same by the sensor's model with nothing in the way.
  double explained = 0.0;  ///< The same with what was found.
};

/// Finds what blocks the sensor of whole scans (each return of the pattern's beams, but those that
/// did not come back) of which a map has what it saw.
///
/// Directions are counted in `DirectionCells`. What a cell should bring back are those beams that
/// come back by the model from the map's surface within 12 m (or a third of the farthest rated
/// range, if that is less), at an incidence of up to 70 degrees. The share that is missing, beyond
/// what three quarters of the cells of the same elevation miss as well (surfaces may be darker than
/// the model takes them to be), is blocked: below a tenth it is taken for chance, and so are cells
/// that hang together and are all blocked less than half of the time; of cells with fewer than 100
/// such beams nothing is said. Throws InputError if no direction can be told.
BlockageFit fit_blockage(const std::vector<RealScan>& scans,
                         const LidarSettings& lidar,
                         const Surroundings& surroundings,
                         const Renderer& renderer,
                         const Executor& executor,
                         const Progress& progress = {});

}  // namespace pointflight
