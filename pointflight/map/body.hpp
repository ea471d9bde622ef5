#pragma once

#include <cstdint>
#include <memory>
#include <variant>

#include "pointflight/geometry/assembly.hpp"
#include "pointflight/geometry/motion.hpp"
#include "pointflight/geometry/solid.hpp"
#include "pointflight/map/surfel_map.hpp"

namespace pointflight {

/// What was seen or hit: 0 the map, from 1 on the vehicles, from `kFirstObstacle` on the obstacles.
using Label = std::uint32_t;
inline constexpr Label kMapLabel = 0;      ///< The map.
inline constexpr Label kFirstVehicle = 1;  ///< Label of vehicle 0.
/// Label of obstacle 0: there are no more vehicles than fit below.
inline constexpr Label kFirstObstacle = 10001;
inline constexpr Label kFalseReturn = 65535;  ///< Of a return where nothing is.

/// Shape of a body: an exact solid, or surfels of a cloud or mesh of its own.
using BodyShape = std::variant<Solid, std::shared_ptr<const SurfelMap>>;

/// Something that moves through the map, from one instant to another.
struct Body {
  Label label = kMapLabel;  ///< What scans call it.
  BodyShape shape;          ///< In the body's own frame.
  /// What LiDARs see instead of `shape`, in the body's own frame; null: `shape`.
  std::shared_ptr<const Assembly> look;
  float intensity = 0.0f;          ///< Of a solid's returns; surfels have their own.
  Motion motion;                   ///< Known at least from `from` until `until`.
  double speed_max = 0.0;          ///< Of its origin in that time, m/s.
  SimTime from = SimTime::min();   ///< It is there from here on...
  SimTime until = SimTime::max();  ///< ... to before here.

  /// Where it is at an instant. Callable from several threads.
  [[nodiscard]] Pose T_world_body(SimTime time) const { return pose_at(motion, time); }
};

/// The farthest point of the shape from its own origin, m.
inline double bounding_radius(const BodyShape& shape) {
  if (const auto* solid = std::get_if<Solid>(&shape)) return bounding_radius(*solid);
  const SurfelMap& map = *std::get<std::shared_ptr<const SurfelMap>>(shape);
  const Aabb& box = map.bounds_world();
  if (box.empty()) return 0.0;
  // bounds are of surfel centres; a surfel reaches 3 deviations of at most 1.8 r beyond
  return box.min.cwiseAbs().cwiseMax(box.max.cwiseAbs()).norm() + 6.7 * map.resolution();
}

/// The farthest point that LiDARs see of a body from its own origin, m.
inline double visible_radius(const Body& body) {
  return body.look ? bounding_radius(*body.look) : bounding_radius(body.shape);
}

}  // namespace pointflight
