#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "pointflight/core/parallel.hpp"
#include "pointflight/geometry/types.hpp"
#include "pointflight/learn/traffic.hpp"
#include "pointflight/lidar/return_chances.hpp"
#include "pointflight/render/renderer.hpp"

namespace pointflight {

/// The same directions from many poses: what policies see.
class RangePattern {
 public:
  /// Of a vehicle by its number; callable from several threads.
  using BodiesOf = std::function<std::vector<Body>(std::uint32_t vehicle)>;
  /// The same: where its draws are.
  using DrawsOf = std::function<ScanAddress(std::uint32_t vehicle)>;

  /// `directions` (unit vectors, sensor frame) and, for each, when it is measured as a share of the
  /// period, 0 to 1; empty: all at the end, from one pose. Each `pooled` of them in succession make
  /// one number of the image, the least of their ranges. Throws std::invalid_argument.
  RangePattern(std::vector<Vector3f> directions,
               std::vector<float> shares,
               float range_max,
               std::size_t pooled = 1);

  /// From now on a beam says what a sensor reports of what it hits, with noise, or nothing; its
  /// nearest return counts. Null: the exact range.
  void report_by(std::shared_ptr<const ReturnModel> returns) { returns_ = std::move(returns); }

  /// Numbers of one image.
  [[nodiscard]] std::size_t size() const { return beams_->beams.size() / pooled_; }
  /// m
  [[nodiscard]] float range_max() const { return range_max_; }

  /// Ranges as shares of `range_max`, 1 where nothing is hit, of the vehicles with these numbers:
  /// `poses` and rows of `ranges` (`size()` each) are by number. All are rendered together, each
  /// with the map and what `bodies_of` says that moves around it; null: nothing. A sensor's reports
  /// need `draws_of`.
  void measure(const Renderer& renderer,
               std::span<const PosePair> poses,
               std::span<const std::uint32_t> vehicles,
               std::span<float> ranges,
               const Executor& executor,
               const BodiesOf& bodies_of = nullptr,
               const DrawsOf& draws_of = nullptr) const;

 private:
  [[nodiscard]] std::vector<Duration> offsets(const PosePair& poses) const;
  [[nodiscard]] AimedBeams aimed(const PosePair& poses) const;
  void report(std::span<Hit> hits, const ScanAddress& address) const;

  std::shared_ptr<const SensorBeams> beams_;
  std::vector<float> shares_;
  float range_max_;
  std::size_t pooled_;
  std::shared_ptr<const ReturnModel> returns_;  ///< Or null.
};

}  // namespace pointflight
