// Holes in floors and walls: what lies within a large plane and has no surfel.
#pragma once

#include <cstdint>
#include <vector>

#include "pointflight/core/parallel.hpp"
#include "pointflight/map/large_planes.hpp"
#include "pointflight/map/surfel_map.hpp"

namespace pointflight {

/// Where a plane goes on that has no surfel there.
struct HoleCell {
  Vector3d center_world = Vector3d::Zero();   ///< m
  Vector3d normal_world = Vector3d::UnitZ();  ///< Of the plane there; unit vector, either way.
  std::uint32_t beside = 0;  ///< Index in `SurfelMap::words()` of a surfel of the plane nearby.
};

/// Which cells belong to a hole.
struct HoleOptions {
  double reach = 1.0;       ///< Surfels of the plane have to lie so near around a cell, m.
  double gap = 112.5;       ///< Widest angle within the plane without one, degrees.
  double tilt = 15.0;       ///< Most by which they may slope against the plane, degrees.
  double roughness = 0.03;  ///< And how far off their own plane they may lie (and 0.5 r), m.
};

/// The cells, r wide, of all holes in a map's large planes: those around which the plane was seen
/// at least on three sides. Does not depend on threads.
std::vector<HoleCell> find_hole_cells(const SurfelMap& map,
                                      const std::vector<LargePlane>& planes,
                                      const HoleOptions& options,
                                      const Executor& executor);

}  // namespace pointflight
