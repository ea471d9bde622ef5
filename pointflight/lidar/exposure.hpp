#pragma once

#include "pointflight/core/parallel.hpp"
#include "pointflight/lidar/scan.hpp"
#include "pointflight/render/renderer.hpp"

namespace pointflight {

/// A scan under way: its beams are aimed, `job` is to be rendered, then `finish` makes the scan,
/// once. Whoever has several scans under way hands the renderer the jobs of all at once.
class Exposure {
 public:
  virtual ~Exposure() = default;
  /// What is to be rendered, valid as long as this is.
  [[nodiscard]] virtual RenderJob job() = 0;
  /// The scan, when the job is rendered.
  [[nodiscard]] virtual Scan finish(const Executor& executor) = 0;
};

}  // namespace pointflight
