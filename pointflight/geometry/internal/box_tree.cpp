#include "pointflight/geometry/internal/box_tree.hpp"

#include <algorithm>
#include <numeric>
#include <utility>

namespace pointflight {
namespace {

constexpr std::uint32_t kLeafBoxes = 4;

double distance(const Aabb& box, const Vector3d& position) {
  return (position.cwiseMax(box.min).cwiseMin(box.max) - position).norm();
}

}  // namespace

BoxTree::BoxTree(std::vector<Aabb> boxes) : boxes_(std::move(boxes)), order_(boxes_.size()) {
  std::iota(order_.begin(), order_.end(), 0u);
  if (!boxes_.empty()) build(0, static_cast<std::uint32_t>(boxes_.size()));
}

void BoxTree::build(std::uint32_t begin, std::uint32_t end) {
  const std::size_t index = nodes_.size();
  nodes_.emplace_back();
  Aabb box;
  Aabb centers;
  for (std::uint32_t i = begin; i < end; ++i) {
    const Aabb& own = boxes_[order_[i]];
    box.add(own.min);
    box.add(own.max);
    centers.add(0.5 * (own.min + own.max));
  }
  nodes_[index].box = box;
  if (end - begin <= kLeafBoxes) {
    nodes_[index].first = begin;
    nodes_[index].count = end - begin;
    return;
  }
  int axis = 0;
  centers.size().maxCoeff(&axis);
  const std::uint32_t middle = begin + (end - begin) / 2;
  const auto center = [&](std::uint32_t i) { return boxes_[i].min[axis] + boxes_[i].max[axis]; };
  std::nth_element(order_.begin() + begin,
                   order_.begin() + middle,
                   order_.begin() + end,
                   [&](std::uint32_t a, std::uint32_t b) { return center(a) < center(b); });
  build(begin, middle);
  nodes_[index].first = static_cast<std::uint32_t>(nodes_.size());
  build(middle, end);
}

std::vector<std::uint32_t> BoxTree::within(const Vector3d& position, double reach) const {
  std::vector<std::uint32_t> found;
  std::vector<std::uint32_t> waiting;
  if (!nodes_.empty()) waiting.push_back(0);
  while (!waiting.empty()) {
    const std::uint32_t at = waiting.back();
    waiting.pop_back();
    const Node& node = nodes_[at];
    if (distance(node.box, position) > reach) continue;
    if (node.count == 0) {
      waiting.push_back(node.first);
      waiting.push_back(at + 1);
      continue;
    }
    for (std::uint32_t i = node.first; i < node.first + node.count; ++i) {
      if (distance(boxes_[order_[i]], position) <= reach) found.push_back(order_[i]);
    }
  }
  std::sort(found.begin(), found.end());
  return found;
}

bool BoxTree::is_passed(const Aabb& box,
                        const Vector3d& origin,
                        const Vector3d& inverse,
                        double end) {
  double low = 0.0;
  double high = end;
  for (int axis = 0; axis < 3; ++axis) {
    double a = (box.min[axis] - origin[axis]) * inverse[axis];
    double b = (box.max[axis] - origin[axis]) * inverse[axis];
    if (a > b) std::swap(a, b);
    low = std::max(low, a);
    high = std::min(high, b);
  }
  return low <= high;
}

}  // namespace pointflight
