// What deskewing left in real scans, found by how they lie in a map of what they saw.
#pragma once

#include <cstddef>
#include <vector>

#include "pointflight/core/parallel.hpp"
#include "pointflight/core/progress.hpp"
#include "pointflight/fidelity/scan_comparison.hpp"
#include "pointflight/lidar/lidar_settings.hpp"
#include "pointflight/lidar/residual_motion.hpp"
#include "pointflight/map/surfel_map.hpp"
#include "pointflight/render/renderer.hpp"
#include "pointflight/survey/noise_fit.hpp"

namespace pointflight {

/// The result of `fit_deskewing`.
struct DeskewingFit {
  std::vector<ResidualMotion> motions;  ///< Of the scans that tell it, in their order.
  FittedSigma rotation;                 ///< About each axis over a scan, rad.
  FittedSigma translation;              ///< Along each axis over a scan, m.
};

/// Finds the motion that is left within scans of a spinning sensor: of each scan the returns'
/// distances from the planar surfels of the map along their rays are explained by a pose that is
/// off and a motion in proportion to time, which their azimuth tells, by robust least squares
/// (Cauchy's weights; one return in each cube of 0.15 m). Variances are those over the scans less
/// what their own noise makes of it. What the map itself is bent by counts as well. None of a
/// sensor whose azimuths do not tell the time, or of fewer than five scans that tell it.
/// `renderer`: of `map`.
DeskewingFit fit_deskewing(const std::vector<RealScan>& scans,
                           const LidarSettings& lidar,
                           const SurfelMap& map,
                           const Renderer& renderer,
                           const Executor& executor,
                           const Progress& progress = {});

}  // namespace pointflight
