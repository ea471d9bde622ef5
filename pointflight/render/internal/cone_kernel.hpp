#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "pointflight/map/surfel_map.hpp"
#include "pointflight/render/internal/beam_kernel.hpp"
#include "pointflight/render/wide_beams.hpp"

namespace pointflight {

/// Beams wider than this (radius, rad) are no cones: across them, directions are not parallel.
inline constexpr float kWidestCone = 0.1f;

/// Finds the echoes of the wide beams `order[0..]` in a map, with as many sub-rays as it takes
/// (docs/architecture.md, "Wide beams"). The results are the same bits on all instruction sets,
/// whatever the order and whatever else is traced in the same call, but for beams that touch more
/// than 1,000 surfels.
void trace_cones(const SurfelMap& surfels,
                 const KernelMap& map,
                 std::span<const MapRay> rays,
                 std::span<const std::uint32_t> order,
                 const WideBeams& wide);

/// Numbers of a map that the kernel makes for itself, for one on another device.
struct ConeConstants {
  float radius;                 ///< Of beams as they are looked at, sigmas.
  float solid_support;          ///< Of the support, what counts as the surfel between sub-rays.
  float leaf_reach;             ///< The support and a little.
  float weight_scale;           ///< Of a hit in the middle, in the kernel's steps.
  float tau;                    ///< In these.
  float depth_steps_per_metre;  ///< Of the window.
  float metres_per_depth_step;  ///< The inverse.
};
[[nodiscard]] ConeConstants cone_constants(const KernelMap& map);

/// What the second level's sub-rays of a beam hit, by its list, on another device.
struct SecondLevel {
  static constexpr std::size_t kCount = 32;
  std::array<float, kCount> ranges;         ///< m; 3e38: nothing.
  std::array<float, kCount> cosines;        ///< `KernelHit::cos_incidence`
  std::array<std::uint32_t, kCount> words;  ///< `KernelHit::strongest`
  std::size_t direction;                    ///< `sub_rays_of_level`
  bool has_before;  ///< A surfel that counts lies before all of them, at any of the first eight.
};
/// The echoes of that beam; false: they may be others with more sub-rays (`trace_cones`).
[[nodiscard]] bool find_second_level_echoes(const SurfelMap& surfels,
                                            const WideBeams& wide,
                                            const SecondLevel& hits,
                                            Echoes& echoes);
/// The same of eight of the first level that are settled, as one echo: false: they may be others.
[[nodiscard]] bool is_sure_of(const WideBeams& wide, const Echo& echo);

/// True if more sub-rays may change which echoes are reported: few of them hit one that is on the
/// verge of being reported.
[[nodiscard]] bool needs_more_sub_rays(const Echoes& echoes, const EchoReceiver& receiver);

}  // namespace pointflight
