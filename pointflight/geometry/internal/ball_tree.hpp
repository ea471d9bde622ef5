#pragma once

#include <cstdint>
#include <vector>

#include "pointflight/geometry/types.hpp"

namespace pointflight {

struct BoundingBall {
  Vector3d center = Vector3d::Zero();
  double radius = 0.0;
};

/// Many balls, found by place: a binary hierarchy of boxes.
class BallTree {
 public:
  explicit BallTree(std::vector<BoundingBall> balls);

  /// Numbers of the balls that come within `reach` of a place, in rising order.
  [[nodiscard]] std::vector<std::uint32_t> within(const Vector3d& place, double reach) const;

 private:
  struct Node {
    Vector3d min, max;        ///< Of all of its balls.
    std::uint32_t begin = 0;  ///< Of its balls in `order_`.
    std::uint32_t end = 0;
    std::uint32_t right = 0;  ///< Child; the left one follows its parent. 0: a leaf.
  };
  void build(std::uint32_t begin, std::uint32_t end);

  std::vector<BoundingBall> balls_;
  std::vector<std::uint32_t> order_;
  std::vector<Node> nodes_;
};

}  // namespace pointflight
