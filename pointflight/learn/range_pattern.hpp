#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "pointflight/core/parallel.hpp"
#include "pointflight/geometry/types.hpp"
#include "pointflight/learn/traffic.hpp"
#include "pointflight/render/renderer.hpp"

namespace pointflight {

/// The same directions from many poses: what policies see.
class RangePattern {
 public:
  /// Of a vehicle by its number; callable from several threads.
  using BodiesOf = std::function<std::vector<Body>(std::uint32_t vehicle)>;

  /// `directions` (unit vectors, sensor frame) and, for each, when it is measured as a share of the
  /// period, 0 to 1; empty: all at the end, from one pose. Each `pooled` of them in succession make
  /// one number of the image, the least of their ranges. Throws std::invalid_argument.
  RangePattern(std::vector<Vector3f> directions,
               std::vector<float> shares,
               float range_max,
               std::size_t pooled = 1);

  /// Numbers of one image.
  [[nodiscard]] std::size_t size() const { return directions_.size() / pooled_; }
  /// m
  [[nodiscard]] float range_max() const { return range_max_; }

  /// Ranges as shares of `range_max`, 1 where nothing is hit, of the vehicles with these numbers:
  /// `poses` and rows of `ranges` (`size()` each) are by number. All are rendered together, each
  /// with the map and what `bodies_of` says that moves around it; null: nothing.
  void measure(const Renderer& renderer,
               std::span<const PosePair> poses,
               std::span<const std::uint32_t> vehicles,
               std::span<float> ranges,
               const Executor& executor,
               const BodiesOf& bodies_of = nullptr) const;

 private:
  [[nodiscard]] std::vector<Duration> offsets(const PosePair& poses) const;
  void aim(const PosePair& poses, std::span<Ray> rays) const;

  std::vector<Vector3f> directions_;
  std::vector<float> shares_;
  float range_max_;
  std::size_t pooled_;
  std::vector<std::uint32_t> order_;  ///< In which they are traced.
};

}  // namespace pointflight
