#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "pointflight/core/random.hpp"
#include "pointflight/lidar/beam_pattern.hpp"
#include "pointflight/lidar/lidar_settings.hpp"

namespace pointflight {

/// By how much ranges are off throughout a run: the sensor's as a whole and each ring's.
class RangeOffsets {
 public:
  /// `sensor`: the entity of its random streams. Without offsets nothing is drawn.
  RangeOffsets(const RangeNoiseSettings& noise,
               std::uint64_t seed,
               std::uint32_t sensor,
               std::span<const Beam> beams) {
    if (!(noise.offset_sigma > 0.0) && !(noise.ring_offset_sigma > 0.0)) return;
    std::uint16_t rings = 0;
    for (const Beam& beam : beams) rings = std::max(rings, beam.ring);
    const RandomStream random(seed, StreamId::kLidarOffset, sensor);
    const double whole = noise.offset_sigma * random.normal(0);
    of_ring_.resize(rings + std::size_t{1});
    for (std::size_t ring = 0; ring < of_ring_.size(); ++ring) {
      of_ring_[ring] =
          static_cast<float>(whole + noise.ring_offset_sigma * random.normal(ring + 1));
    }
  }

  /// True if all are 0.
  [[nodiscard]] bool empty() const { return of_ring_.empty(); }
  /// Of one of the beams, m.
  [[nodiscard]] float of(const Beam& beam) const {
    return of_ring_.empty() ? 0.0f : of_ring_[beam.ring];
  }

 private:
  std::vector<float> of_ring_;
};

}  // namespace pointflight
