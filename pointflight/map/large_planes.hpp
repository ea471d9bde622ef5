// Floors, walls, ceilings: the large flat surfaces of a map.
#pragma once

#include <vector>

#include "pointflight/core/parallel.hpp"
#include "pointflight/map/surfel_map.hpp"

namespace pointflight {

/// About a square metre of a flat surface: planar surfels beside each other in one plane.
struct PlanePatch {
  Vector3d middle_world = Vector3d::Zero();   ///< Mean of their centres, m.
  Vector3d normal_world = Vector3d::UnitZ();  ///< Unit vector; either way.
  double area = 0.0;                          ///< Of as many cells as there are surfels, m^2.
};

/// A surface of patches that continue each other, across gaps as well. It may bend a little: a
/// floor that slopes to a drain, a map that is bent by its survey's drift.
struct LargePlane {
  std::vector<PlanePatch> patches;  ///< Their normals point to the same side as the plane's.
  Vector3d normal_world = Vector3d::UnitZ();  ///< Mean of the patches', by area; unit vector.
  Vector3d middle_world = Vector3d::Zero();   ///< Mean of the patches', by area, m.
};

/// How patches make a plane.
struct LargePlaneOptions {
  double gap = 2.5;          ///< Middles of neighbouring patches may lie so far apart, m.
  double offset = 0.06;      ///< A patch may lie so far beside another's plane (and 0.5 r), m.
  double patch_tilt = 10.0;  ///< Between neighbours, degrees.
  double plane_tilt = 15.0;  ///< Between a patch and its plane, degrees.
  double length = 2.0;       ///< Least extent, m.
  double width = 1.0;        ///< Least extent across, m.
  double area = 2.0;         ///< Least area of patches, m^2.
};

/// Those of a map, the largest first. Does not depend on threads.
std::vector<LargePlane> find_large_planes(const SurfelMap& map,
                                          const LargePlaneOptions& options,
                                          const Executor& executor);

}  // namespace pointflight
