#pragma once

#include <memory>
#include <vector>

#include "pointflight/lidar/lidar.hpp"

namespace pointflight {

/// The beams of a scan in the world.
struct Lidar::Aimed {
  ScanRequest request;
  std::shared_ptr<const ScanBeams::Ordered> ordered;
  bool snapshot = false;
  Pose middle;                    ///< T_world_sensor in the middle of the scan.
  AimedBeams in_world;            ///< Their axes.
  std::vector<Duration> offsets;  ///< Their times, if bodies move meanwhile.

  [[nodiscard]] const std::vector<Beam>& beams() const { return ordered->beams; }
};

}  // namespace pointflight
