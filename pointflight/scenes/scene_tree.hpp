#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "pointflight/geometry/internal/shape_tree.hpp"
#include "pointflight/scenes/exact_scene.hpp"

namespace pointflight {

/// What a LiDAR's beams hit in a scene. Shapes with the tag "glass" send a beam back within 15
/// degrees of their normal and are not there for any other: what a pane does to 905 nm. Those with
/// the tag "water" send back the same beams, and no other comes back from there or behind.
class SceneTree {
 public:
  /// Refers to the scene, which must outlive the tree and stay as it is.
  explicit SceneTree(const ExactScene& scene);

  /// First shape that sends a beam (unit `direction`) back.
  [[nodiscard]] std::optional<ShapeTree::Hit> intersect(const Vector3d& origin,
                                                        const Vector3d& direction) const;

  /// True if no shape, glass included, is nearer than `radius`, as seen along `looks` directions.
  [[nodiscard]] bool is_free(const Vector3d& place, double radius, std::size_t looks) const;

 private:
  const ExactScene& scene_;
  ShapeTree tree_;
  std::vector<std::uint8_t> mirrors_;  ///< `Opacity` of each tag: pane, water, opaque.
};

/// Unit vector, rad.
Vector3d unit_direction(double azimuth, double elevation);

}  // namespace pointflight
