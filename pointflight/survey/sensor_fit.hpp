// A sensor's own figures from scans that it took standing still: noise, rate, rings.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "pointflight/core/parallel.hpp"
#include "pointflight/lidar/lidar_settings.hpp"
#include "pointflight/survey/noise_fit.hpp"
#include "pointflight/survey/ring_fit.hpp"
#include "pointflight/survey/scan_source.hpp"

namespace pointflight {

/// Noise within a range of ranges and incidences.
struct NoiseBin {
  double range_from = 0.0;      ///< Nearest, m.
  double range_to = 0.0;        ///< Before this, m.
  double incidence_from = 0.0;  ///< Steepest, rad.
  double incidence_to = 0.0;    ///< Before this, rad.
  double range = 0.0;           ///< Mean of its patches, m.
  double tangent = 0.0;         ///< Root mean square of range times tan(incidence), m.
  double sigma = 0.0;           ///< Of ranges about the patches' planes, m: the median patch's.
  double fitted = 0.0;      ///< What `SensorFit::noise` gives there, m: root of the mean square.
  std::size_t patches = 0;  ///< Flat pieces of what was seen.
  std::size_t points = 0;   ///< On them.
};

/// What scans of a sensor that stood still say of it.
struct SensorFit {
  std::size_t scans = 0;       ///< Looked at.
  std::size_t points = 0;      ///< In them.
  std::size_t patches = 0;     ///< Flat pieces that noise was measured on.
  std::size_t on_patches = 0;  ///< Points on them.
  double patch_deg = 0.0;      ///< Their width, degrees.
  NoiseFit noise;           ///< Of ranges, of directions about each of two axes, of weak signals.
  FittedSigma ring_offset;  ///< How ranges of rings are off, m: part of it planes have taken.
  double range_step = 0.0;  ///< Ranges are whole multiples of it, m; 0: they are not.
  double range_min = 0.0;   ///< Of all returns, m.
  double range_max = 0.0;   ///< Of all returns, m.
  /// Root mean square of what patches move from scan to scan, by what their noise explains: 1 for a
  /// sensor and a position at rest. 0: too few scans to tell.
  double unrest = 0.0;
  std::vector<NoiseBin> bins;   ///< Those with three patches or more.
  std::optional<double> rate;   ///< Scans per second, by their stamps.
  std::optional<TurnFit> turn;  ///< Where points have times and rings, and azimuths turn evenly.
};

/// Fits them. A patch is a cell of directions whose returns lie on one plane: 1 / range is linear
/// across it (n·d / D). Its deviation s of ranges about the plane, at range R and incidence i, is
/// s^2 = sigma_r^2 + (R tan i sigma_a)^2, from which both follow by weighted least squares; patches
/// that deviate much more are not flat and count no further. With `rated` ranges, how weak signals
/// are is reckoned from range and incidence on surfaces of unknown reflectivity, and what ranges
/// jitter more for it is a third part: it shows if walls were far enough. What is uneven of a wall
/// counts as noise, as does each ring's own offset; an offset that all ranges have does not show.
/// Throws InputError if too little of what was seen is flat.
SensorFit fit_sensor(std::span<const RecordedScan> scans,
                     const Executor& executor,
                     const Progress& progress = {},
                     const DetectionSettings& rated = {},
                     double sun_klx = 100.0);

/// `base` with what was measured in place of its own: rate, noise (of weak signals and of rings'
/// offsets if it shows), and, where `rings_table` is given (the name of a file of `rings_csv`),
/// rings.
LidarSettings with_fit(LidarSettings base, const SensorFit& fit, const std::string& rings_table);

}  // namespace pointflight
