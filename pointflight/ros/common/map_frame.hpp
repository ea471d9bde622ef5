// A frame of its own for clouds of a map that lies far from zero.
#pragma once

#include <optional>
#include <string>

#include "pointflight/geometry/types.hpp"
#include "pointflight/ros/common/profile.hpp"

namespace pointflight {

/// Points of clouds are float32, whose steps grow with the distance from zero: 1 mm at 8 km, half a
/// metre in UTM. Clouds in the world of such a map are given in a frame beside it; poses and
/// commands, which are doubles, stay in the world's.
struct MapFrame {
  std::string name;  ///< Empty: clouds are in the world's own frame.
  Vector3d origin =
      Vector3d::Zero();  ///< Where its zero is in the world, m; its axes are the world's.
  double step = 0.0;     ///< Of float32 in the world at the map's farthest point, m.
  /// True if the map lies far out.
  [[nodiscard]] bool is_used() const { return !name.empty(); }
};

/// For a map within `bounds_world`: "map", or "map_origin" if the profile has another use for that
/// name.
MapFrame map_frame_for(const Aabb& bounds_world, const RosProfile& profile);

/// What users are told of it, in one line; nothing if it is not used. `map_path` is the map's file.
std::optional<std::string> note_of(const MapFrame& frame,
                                   const RosProfile& profile,
                                   const std::string& map_path);

}  // namespace pointflight
