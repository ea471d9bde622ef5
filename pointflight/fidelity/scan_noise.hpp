// The noise of ranges in real scans beside a sensor file's: how far points lie off planes.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "pointflight/core/parallel.hpp"
#include "pointflight/core/progress.hpp"
#include "pointflight/fidelity/scan_comparison.hpp"
#include "pointflight/lidar/lidar_settings.hpp"
#include "pointflight/lidar/return_model.hpp"
#include "pointflight/render/renderer.hpp"

namespace pointflight {

/// Deviations of ranges, m, from planes: 1.4826 times the median of their magnitudes.
struct PlaneNoise {
  double real = 0.0;                  ///< In the real scans.
  double modelled = 0.0;              ///< In those that the sensor file makes.
  std::uint64_t real_points = 0;      ///< That it is of.
  std::uint64_t modelled_points = 0;  ///< The same.
};

/// By range.
struct NoiseComparison {
  static constexpr std::array<double, 8> kRanges = {0, 2, 4, 7, 10, 15, 25, 50};  ///< Limits, m.
  static constexpr std::uint64_t kLeastPoints = 100;  ///< Bins with fewer do not count.
  std::array<PlaneNoise, kRanges.size() - 1> bins{};  ///< Between them.

  /// True if a bin counts.
  static bool counts(const PlaneNoise& bin) {
    return bin.real_points >= kLeastPoints && bin.modelled_points >= kLeastPoints;
  }
};

/// Takes a scan with the sensor from the pose of each real one. In both, of every seventh point:
/// its distance along its ray from the plane of the other points of its scan that are near (12 or
/// more within 0.15 m, from 6 m on within 2.5 % of the range), if the map is a plane there that the
/// ray hits at 60 degrees or less. Points more than 0.15 m off the map are left out. What is uneven
/// on the real surface, and what rings are off by, counts as noise.
NoiseComparison compare_noise(const std::vector<RealScan>& scans,
                              const LidarSettings& lidar,
                              const Surroundings& surroundings,
                              const Renderer& renderer,
                              const Executor& executor,
                              const Progress& progress = {});

}  // namespace pointflight
