#pragma once

#include <optional>

#include "pointflight/core/parallel.hpp"
#include "pointflight/lidar/scan.hpp"
#include "pointflight/render/renderer.hpp"

namespace pointflight {

/// A scan under way: `next` and `receive` in turn until nothing is to be rendered any more, then
/// `finish`, once. Whoever has several scans under way hands the renderer the jobs of all at once.
class Exposure {
 public:
  virtual ~Exposure() = default;
  /// The rays to be rendered next; what the job refers to is valid until `receive` has returned.
  [[nodiscard]] virtual std::optional<RenderJob> next(const Executor& executor) = 0;
  /// The hits of the last job are there.
  virtual void receive(const Executor& executor) = 0;
  /// The scan.
  [[nodiscard]] virtual Scan finish(const Executor& executor) = 0;
};

}  // namespace pointflight
