#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "pointflight/core/parallel.hpp"
#include "pointflight/geometry/types.hpp"
#include "pointflight/render/renderer.hpp"

namespace pointflight {

/// Where a vehicle was over one period of its policy.
struct PosePair {
  Pose before;  ///< T_world_body at its start.
  Pose now;     ///< At its end.
};

/// The same directions from many poses: what policies see.
class RangePattern {
 public:
  /// `directions` (unit vectors, sensor frame) and, for each, when it is measured as a share of the
  /// period, 0 to 1; empty: all at the end, from one pose. Throws std::invalid_argument.
  RangePattern(std::vector<Vector3f> directions, std::vector<float> shares, float range_max);

  /// Of one image.
  [[nodiscard]] std::size_t size() const { return directions_.size(); }
  /// m
  [[nodiscard]] float range_max() const { return range_max_; }

  /// Ranges as shares of `range_max`, 1 where nothing is hit, of the vehicles with these numbers:
  /// `poses` and rows of `ranges` (`size()` each) are by number. All are rendered together.
  void measure(const Renderer& renderer,
               std::span<const PosePair> poses,
               std::span<const std::uint32_t> vehicles,
               std::span<float> ranges,
               const Executor& executor) const;

 private:
  void aim(const PosePair& poses, std::span<Ray> rays) const;

  std::vector<Vector3f> directions_;
  std::vector<float> shares_;
  float range_max_;
  std::vector<std::uint32_t> order_;  ///< In which they are traced.
};

}  // namespace pointflight
