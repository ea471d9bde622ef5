#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "pointflight/geometry/shape_scene.hpp"

namespace pointflight {

/// Exact ray casting into many shapes: a binary hierarchy of boxes, all in double.
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
  struct Node {
    Aabb box;
    std::uint32_t first = 0;  ///< Of the leaf's shapes in `order_`, or the right child.
    std::uint32_t count = 0;  ///< Shapes of a leaf; 0 for an inner node, its left child follows it.
  };
  void build(std::uint32_t begin, std::uint32_t end);

  const std::vector<Shape>& shapes_;
  std::vector<Aabb> boxes_;
  std::vector<std::uint32_t> order_;
  std::vector<Node> nodes_;
};

}  // namespace pointflight
