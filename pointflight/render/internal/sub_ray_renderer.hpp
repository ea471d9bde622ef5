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

/// Sub-rays of a wide beam where nothing says how many.
inline constexpr std::size_t kUsualSubRays = 32;

/// The echoes of a beam of which `hits` are its sub-rays'.
Echoes echoes_of_hits(const WideBeams& wide,
                      const std::vector<SubRay>& sub_rays,
                      std::span<const Hit> hits);

/// Renders sub-rays of some of a job's wide beams as lines (`render`), some ten thousand at once.
/// `receive` takes the hits of each beam, from any thread; `k` is its place in `beams`.
void render_sub_rays(const RenderJob& job,
                     std::span<const std::uint32_t> beams,
                     const std::vector<SubRay>& sub_rays,
                     const std::function<void(const RenderJob& lines)>& render,
                     const std::function<void(std::size_t k, std::span<const Hit>)>& receive,
                     const Executor& executor);

/// Finds the echoes of some of a job's wide beams by `count` rays over each.
void find_echoes(const RenderJob& job,
                 std::span<const std::uint32_t> beams,
                 std::size_t count,
                 const std::function<void(const RenderJob& lines)>& render,
                 const Executor& executor);

}  // namespace pointflight
