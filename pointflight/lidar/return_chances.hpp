#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "pointflight/core/random.hpp"
#include "pointflight/lidar/return_model.hpp"

namespace pointflight {

/// Where the draws of a scan are.
struct ScanAddress {
  std::uint64_t seed = 0;    ///< Of the run.
  std::uint32_t sensor = 0;  ///< The entity of its streams.
  std::uint64_t scan = 0;    ///< Its number.
};

/// Draws for the returns of a scan's beams: of noise, detection and weather, each addressed by scan
/// and beam.
class ReturnChances {
 public:
  /// Without `noise` ranges have none.
  ReturnChances(const ScanAddress& address, bool noise);

  /// Of beams that follow each other, the first of which has an even number. Valid until the next
  /// call.
  BeamChances of(std::size_t first, std::size_t count);

 private:
  [[nodiscard]] EchoChance more(std::uint64_t beam, std::size_t echo) const;

  ScanAddress address_;
  bool has_noise_;
  RandomStream noise_, detection_, weather_;
  std::vector<double> normals_, detections_, places_, even_, odd_;
};

}  // namespace pointflight
