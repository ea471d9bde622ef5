#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "pointflight/core/parallel.hpp"
#include "pointflight/render/internal/sub_rays.hpp"
#include "pointflight/render/renderer.hpp"

namespace pointflight {

/// Rays over the cross-sections of some of a job's wide beams, beam by beam.
struct SubRayBatch {
  /// `beams`: numbers of the job's rays; `sub_rays` for each.
  SubRayBatch(const RenderJob& job,
              std::span<const std::uint32_t> beams,
              const std::vector<SubRay>& sub_rays,
              const Executor& executor);
  SubRayBatch(const SubRayBatch&) = delete;  // the job refers to the rays
  SubRayBatch& operator=(const SubRayBatch&) = delete;

  /// Whose hits are written into `hits`.
  [[nodiscard]] RenderJob lines();

  std::vector<Ray> rays;
  std::vector<Duration> offsets;
  std::vector<Hit> hits;

 private:
  RayBatch batch_;
};

/// The echoes of a beam of which `hits` are its sub-rays'.
Echoes echoes_of_hits(const WideBeams& wide,
                      const std::vector<SubRay>& sub_rays,
                      std::span<const Hit> hits);

/// Finds the echoes of some of a job's wide beams by `count` rays over each, which `render_lines`
/// renders, some ten thousand at once.
void render_sub_rays(const RenderJob& job,
                     std::span<const std::uint32_t> beams,
                     std::size_t count,
                     const std::function<void(const RenderJob&)>& render_lines,
                     const Executor& executor);

}  // namespace pointflight
