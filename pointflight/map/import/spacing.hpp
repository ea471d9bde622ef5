#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "pointflight/core/parallel.hpp"
#include "pointflight/io/cloud_reader.hpp"

namespace pointflight {

/// Estimates the point spacing of a streamed cloud from the points of a few randomly chosen blocks.
class SpacingEstimate {
 public:
  /// Adds finite points; the result depends on their order only.
  void add(std::span<const CloudPoint> points, const Executor& executor);

  /// Median distance between a point and its nearest neighbour, m; 0 below 20 usable points.
  [[nodiscard]] double median_spacing() const;

  /// Median of each coordinate: a position amid the cloud that stray points do not move.
  [[nodiscard]] Vector3d middle() const;

 private:
  static constexpr double kBlock = 2.0;              ///< m: far above any useful spacing.
  static constexpr std::size_t kMaxPoints = 200000;  ///< Kept; then blocks are thinned by half.

  using Block = std::array<std::int64_t, 3>;
  static Block block_of(const Vector3d& point);
  static bool is_chosen(const Block& block, std::uint64_t one_in);
  void keep(const Vector3d& point);

  std::vector<Vector3d> kept_;
  std::uint64_t one_in_ = 1;
};

/// The smallest resolution that a spacing supports: 2.0 times it (measured on scans of a hall:
/// below, walls get holes), rounded up to two digits.
double supported_resolution(double spacing);

}  // namespace pointflight
