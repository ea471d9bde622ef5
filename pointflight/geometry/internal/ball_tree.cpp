#include "pointflight/geometry/internal/ball_tree.hpp"

#include <algorithm>
#include <numeric>

namespace pointflight {
namespace {

constexpr std::uint32_t kLeaf = 8;  // balls

}  // namespace

BallTree::BallTree(std::vector<BoundingBall> balls)
    : balls_(std::move(balls)), order_(balls_.size()) {
  std::iota(order_.begin(), order_.end(), 0u);
  if (!balls_.empty()) build(0, static_cast<std::uint32_t>(balls_.size()));
}

void BallTree::build(std::uint32_t begin, std::uint32_t end) {
  const std::size_t at = nodes_.size();
  Node node;
  node.begin = begin;
  node.end = end;
  Vector3d low = balls_[order_[begin]].center;
  Vector3d high = low;
  node.min = node.max = low;
  for (std::uint32_t i = begin; i < end; ++i) {
    const BoundingBall& ball = balls_[order_[i]];
    low = low.cwiseMin(ball.center);
    high = high.cwiseMax(ball.center);
    node.min = node.min.cwiseMin((ball.center.array() - ball.radius).matrix());
    node.max = node.max.cwiseMax((ball.center.array() + ball.radius).matrix());
  }
  nodes_.push_back(node);
  if (end - begin <= kLeaf) return;
  Eigen::Index axis = 0;
  (high - low).maxCoeff(&axis);
  const std::uint32_t middle = begin + (end - begin) / 2;
  std::nth_element(order_.begin() + begin,
                   order_.begin() + middle,
                   order_.begin() + end,
                   [&](std::uint32_t a, std::uint32_t b) {
                     return balls_[a].center[axis] < balls_[b].center[axis];
                   });
  build(begin, middle);
  nodes_[at].right = static_cast<std::uint32_t>(nodes_.size());
  build(middle, end);
}

std::vector<std::uint32_t> BallTree::within(const Vector3d& place, double reach) const {
  std::vector<std::uint32_t> found;
  std::vector<std::uint32_t> waiting;
  if (!nodes_.empty()) waiting.push_back(0);
  while (!waiting.empty()) {
    const std::uint32_t at = waiting.back();
    waiting.pop_back();
    const Node& node = nodes_[at];
    const Vector3d nearest = place.cwiseMax(node.min).cwiseMin(node.max);
    if ((nearest - place).norm() > reach) continue;
    if (node.right != 0) {
      waiting.push_back(node.right);
      waiting.push_back(at + 1);
      continue;
    }
    for (std::uint32_t i = node.begin; i < node.end; ++i) {
      const BoundingBall& ball = balls_[order_[i]];
      if ((ball.center - place).norm() <= reach + ball.radius) found.push_back(order_[i]);
    }
  }
  std::sort(found.begin(), found.end());
  return found;
}

}  // namespace pointflight
