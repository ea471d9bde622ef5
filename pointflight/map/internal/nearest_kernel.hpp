#pragma once

#include <cstdint>
#include <span>

#include "pointflight/map/bvh8.hpp"
#include "pointflight/map/surfel_scale.hpp"

namespace pointflight {

/// The nearest surfel that `find_nearest` found.
struct NearestWord {
  float squared_distance = 0.0f;
  std::uint32_t leaf = 0;  ///< Word of its leaf's header.
  std::uint32_t word = 0;  ///< 0 if nothing is within the distance.
};

/// Nearest surfel to a point (metres from the map's origin) within `max_distance`: best-first
/// through the hierarchy, eight boxes or surfels at a time, the same bits on every instruction set.
NearestWord find_nearest(std::span<const Bvh8Node> nodes,
                         std::span<const SurfelWord> words,
                         const SurfelScale& scale,
                         double resolution,
                         const Vector3d& point,
                         double max_distance);

}  // namespace pointflight
