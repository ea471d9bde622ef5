#pragma once

#include <algorithm>
#include <cstdint>

#include "pointflight/core/floor.hpp"

namespace pointflight {

/// Where a ray starts along one axis: a voxel of the map's grid, and the rest, m. Corners of leaves
/// are voxels, too, so that the way to one takes no double: the same bits on processors and on GPUs
/// that have none.
struct GridOrigin {
  std::int32_t voxel;
  float rest;  ///< m
};

/// Of a coordinate from the map's origin, m.
inline GridOrigin grid_origin(double coordinate, double resolution) {
  constexpr double kMost = 1 << 30;  // voxels: what is farther away hits nothing
  const std::int64_t voxel = floor_to_integer(std::clamp(coordinate / resolution, -kMost, kMost));
  return {static_cast<std::int32_t>(voxel),
          static_cast<float>(coordinate - static_cast<double>(voxel) * resolution)};
}

/// From there to the corner of a leaf, m; `r`: the map's resolution.
inline float to_corner(std::uint32_t leaf, const GridOrigin& from, float r) {
  return static_cast<float>(static_cast<std::int32_t>(leaf) - from.voxel) * r - from.rest;
}

}  // namespace pointflight
