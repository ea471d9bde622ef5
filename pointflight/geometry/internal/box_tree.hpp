#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <vector>

#include "pointflight/geometry/types.hpp"

namespace pointflight {

/// Many boxes, found by what is near to them or passes through them: a binary hierarchy, all in
/// double.
class BoxTree {
 public:
  BoxTree() = default;
  explicit BoxTree(std::vector<Aabb> boxes);

  /// Numbers of the boxes within `reach` (m) of a position, in rising order.
  [[nodiscard]] std::vector<std::uint32_t> within(const Vector3d& position, double reach) const;

  /// Calls `visit(number)` for the boxes that a ray (unit `direction`) passes before `end` (m), and
  /// some more, roughly the nearest first; `visit` may lower `end`.
  template <class Visit>
  void along(const Vector3d& origin,
             const Vector3d& direction,
             const double& end,
             const Visit& visit) const;

 private:
  struct Node {
    Aabb box;
    std::uint32_t first = 0;  ///< Of a leaf's boxes in `order_`, or the right child.
    std::uint32_t count = 0;  ///< Boxes of a leaf; 0 for an inner node, its left child follows it.
  };
  void build(std::uint32_t begin, std::uint32_t end);
  [[nodiscard]] static bool is_passed(const Aabb& box,
                                      const Vector3d& origin,
                                      const Vector3d& inverse,
                                      double end);

  std::vector<Aabb> boxes_;
  std::vector<std::uint32_t> order_;
  std::vector<Node> nodes_;
};

template <class Visit>
void BoxTree::along(const Vector3d& origin,
                    const Vector3d& direction,
                    const double& end,
                    const Visit& visit) const {
  if (nodes_.empty()) return;
  Vector3d inverse;
  for (int axis = 0; axis < 3; ++axis) {
    const double d = direction[axis];
    inverse[axis] = 1.0 / (std::abs(d) > 1e-300 ? d : 1e-300);
  }
  std::array<std::uint32_t, 64> stack{};  // halves of up to 2^32 boxes
  std::size_t depth = 0;
  stack[depth++] = 0;
  while (depth > 0) {
    const std::uint32_t at = stack[--depth];
    const Node& node = nodes_[at];
    if (!is_passed(node.box, origin, inverse, end)) continue;
    if (node.count == 0) {
      // the side that the ray comes to first on top
      const std::uint32_t left = at + 1;
      const Vector3d way = (nodes_[node.first].box.min + nodes_[node.first].box.max) -
                           (nodes_[left].box.min + nodes_[left].box.max);
      const bool left_first = way.dot(direction) >= 0.0;
      stack[depth++] = left_first ? node.first : left;
      stack[depth++] = left_first ? left : node.first;
      continue;
    }
    for (std::uint32_t i = node.first; i < node.first + node.count; ++i) visit(order_[i]);
  }
}

}  // namespace pointflight
