#pragma once

#include <cstddef>
#include <optional>
#include <span>

#include "pointflight/map/surfel_map.hpp"

namespace pointflight {

/// The largest flat surface of a map that lies within 30 degrees of level: a floor.
struct FloorPlane {
  Vector3d normal_world = Vector3d::UnitZ();  ///< Unit length, upwards.
  Vector3d middle_world = Vector3d::Zero();   ///< Centroid of its surfels, m.
  double tilt = 0.0;                          ///< Angle between the normal and z, rad.
  double share = 0.0;  ///< Of the surfels that lie within 30 degrees of level: those in the plane.

  /// What walls say, where there are some that the tilt would show on: whether they stand upright
  /// on the floor (the whole map is tilted) or in the world (the floor is a ramp).
  enum class Walls { kNone, kOnTheFloor, kInTheWorld };
  Walls walls = Walls::kNone;  ///< kNone: the floor is level, or there are too few.

  /// Where the floor is level after this; it turns about `middle_world`.
  [[nodiscard]] Pose levelling() const;
};

/// Nothing if no such surface stands out. Does not depend on threads.
std::optional<FloorPlane> find_floor(std::span<const SurfelWord> words,
                                     const Vector3d& origin_world,
                                     double resolution);
/// Of a map that is moved before.
std::optional<FloorPlane> find_floor(const SurfelMap& map, const Pose& T_world_map = {});

}  // namespace pointflight
