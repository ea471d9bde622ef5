#pragma once

#include <cstdint>
#include <vector>

#include "pointflight/geometry/types.hpp"

namespace pointflight {

/// Estimates the point spacing of a streamed cloud from the points of a few randomly chosen blocks.
class SpacingEstimate {
 public:
  void add(const Vector3d& point);

  /// Median distance between a point and its nearest neighbour, m; 0 below 20 usable points.
  [[nodiscard]] double median_spacing() const;

  /// Median of each coordinate: a place amid the cloud that stray points do not move.
  [[nodiscard]] Vector3d middle() const;

 private:
  static constexpr double kBlock = 2.0;              ///< m: far above any useful spacing.
  static constexpr std::size_t kMaxPoints = 200000;  ///< Kept; then blocks are thinned by half.

  [[nodiscard]] bool is_chosen(const Vector3d& point, std::uint64_t one_in) const;

  std::vector<Vector3d> kept_;
  std::uint64_t one_in_ = 1;
};

/// The smallest resolution that a spacing supports: 2.5 times it (measured on scans of a hall:
/// below, walls get holes), rounded up to two digits.
double supported_resolution(double spacing);

}  // namespace pointflight
