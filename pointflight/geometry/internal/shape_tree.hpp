#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "pointflight/geometry/internal/box_tree.hpp"
#include "pointflight/geometry/shape_scene.hpp"

namespace pointflight {

/// Exact ray casting into many shapes.
class ShapeTree {
 public:
  /// Refers to `shapes`, which must outlive the tree and stay as they are.
  explicit ShapeTree(const std::vector<Shape>& shapes);

  struct Hit {
    double range;         ///< m along the ray.
    std::uint32_t shape;  ///< Index in `shapes`.
  };

  /// First intersection of the ray (unit `direction`) with any shape, the same as
  /// `ShapeScene::intersect`.
  [[nodiscard]] std::optional<Hit> intersect(const Vector3d& origin,
                                             const Vector3d& direction) const;

 private:
  const std::vector<Shape>& shapes_;
  BoxTree tree_;
};

}  // namespace pointflight
