// Real scans beside what a sensor file makes of the same scene: how many beams come back from
// where, and where returns lie at edges.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "pointflight/core/parallel.hpp"
#include "pointflight/core/progress.hpp"
#include "pointflight/fidelity/scan_comparison.hpp"
#include "pointflight/lidar/lidar_settings.hpp"
#include "pointflight/lidar/return_model.hpp"
#include "pointflight/render/renderer.hpp"

namespace pointflight {

/// What is compared: reality, the sensor's model, and beams without one: lines that come back from
/// whatever they hit within the sensor's range, with its Gaussian noise.
struct Sides {
  double real = 0.0;      ///< Of the real scans.
  double modelled = 0.0;  ///< Of the model.
  double plain = 0.0;     ///< Without it.
};

/// Beams that hit the map within one range and one incidence.
struct ReturnShare {
  double beams = 0.0;  ///< That the sensor fires there, in all scans.
  Sides returns;       ///< How many came back.
};

/// What comes of it.
struct SensorComparison {
  /// Limits of bins: ranges (m), incidences (deg), errors at edges (m).
  ///@{
  static constexpr std::array<double, 13> kRanges = {
      0, 2, 3, 5, 7, 10, 15, 20, 25, 30, 40, 60, 100};
  static constexpr std::array<double, 9> kIncidences = {0, 30, 45, 60, 70, 75, 80, 85, 90};
  static constexpr std::array<double, 18> kErrors = {
      -5, -2, -1, -0.5, -0.3, -0.2, -0.1, -0.05, -0.02, 0.02, 0.05, 0.1, 0.2, 0.3, 0.5, 1, 2, 5};
  ///@}
  /// A bin with fewer beams does not count.
  static constexpr double kLeastBeams = 300.0;

  /// Of one range, by incidence.
  using OfIncidences = std::array<ReturnShare, kIncidences.size() - 1>;
  std::array<OfIncidences, kRanges.size() - 1> shares{};  ///< By range, then incidence.
  /// Returns at edges by measured minus rendered range, the range that a line along the beam has;
  /// first and last: beyond the limits. The others are without noise of ranges; each has added to
  /// it by how much the nearest real return away from edges is off (within 1.7 degrees and 0.15 m):
  /// what noise, poses and map make of a range.
  std::array<Sides, kErrors.size() + 1> edges{};
  double beams = 0.0;         ///< That the sensor fired, in all scans.
  Sides back;                 ///< Of these: how many came back from `least_range` on.
  double blocked = 0.0;       ///< Of these: in directions where next to nothing ever comes back.
  double least_range = 0.0;   ///< m: nothing is reported from nearer.
  std::uint64_t returns = 0;  ///< Of the real scans.

  /// True if a bin counts.
  static bool counts(const ReturnShare& share) { return share.beams >= kLeastBeams; }
  /// Mean difference from the real share of returns, 0 to 1, over the beams of bins that count.
  /// `real`: 0.
  [[nodiscard]] Sides share_distance() const;
  /// Half the sum of differences from the real distribution of errors at edges, 0 (the same) to 1.
  /// `real`: 0.
  [[nodiscard]] Sides edge_distance() const;
};

/// Fires the sensor's beams from the pose of each real scan and counts what comes back beside what
/// really did, and sends beams along the real returns that lie at edges: if a line within the
/// beam's width hits something more than 0.3 m off the plane that others hit. Real scans must be
/// whole and of that sensor: beams without a return are those of the pattern that the scan lacks.
/// Directions in which next to nothing comes back over all scans (what carries the sensor) are left
/// out of the shares unless the sensor's file says what is in its way (`LidarSettings::blocked`),
/// ranges below the real scans' least as well. The pattern is of a sensor that stands still,
/// which changes shares by how much it turns meanwhile.
SensorComparison compare_sensor(const std::vector<RealScan>& scans,
                                const LidarSettings& lidar,
                                const Surroundings& surroundings,
                                const Renderer& renderer,
                                const Executor& executor,
                                const Progress& progress = {});

}  // namespace pointflight
