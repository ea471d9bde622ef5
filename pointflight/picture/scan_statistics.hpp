#pragma once

#include <cstddef>
#include <optional>
#include <utility>
#include <vector>

#include "pointflight/lidar/lidar_settings.hpp"

namespace pointflight::picture {

/// Figures of a sensor's first scan. Angles in degrees.
struct ScanStatistics {
  std::size_t beams = 0;        ///< A scan.
  double span = 0.0;            ///< From the first beam to the last, s.
  double beams_a_second = 0.0;  ///< Over a second or, below 1 Hz, a scan.
  std::size_t rings = 0;        ///< Rings, rows or lines.
  double blocked = 0.0;         ///< Share of the beams that what carries it takes, on average.
  /// Over all beams.
  ///@{
  double azimuth_min = 0.0, azimuth_max = 0.0;
  ///@}
  /// Over all beams.
  ///@{
  double elevation_min = 0.0, elevation_max = 0.0;
  ///@}
  double along_ring = 0.0;  ///< Between successive beams of a ring or line, median.
  double nearest = 0.0;     ///< From a beam to its nearest neighbour, median.
  /// Between neighbouring rings, least and greatest; only if each has one elevation.
  std::optional<std::pair<double, double>> between_rings;
};

/// Of a sensor's first scan. Throws InputError if its files are wrong.
ScanStatistics scan_statistics(const LidarSettings& settings);

/// Where a beam points.
struct BeamAngles {
  float azimuth_deg;    ///< To the left of the x axis.
  float elevation_deg;  ///< Upwards.
};

/// All beams of a sensor's first `duration` seconds.
std::vector<BeamAngles> pattern_of(const LidarSettings& settings, double duration);

/// How much of the field of view has been hit, over time.
struct Coverage {
  double cell_deg = 0.5;     ///< Of the cells that are counted.
  std::vector<double> time;  ///< s
  /// Fraction of the solid angle between the lowest and the highest beam at each azimuth.
  std::vector<double> fraction;
};
/// Of a sensor's first `duration` seconds.
Coverage coverage_of(const LidarSettings& settings, double duration);

}  // namespace pointflight::picture
