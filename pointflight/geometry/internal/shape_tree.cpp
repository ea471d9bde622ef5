#include "pointflight/geometry/internal/shape_tree.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace pointflight {
namespace {

constexpr std::uint32_t kLeafShapes = 4;

/// Where the ray is inside the box, at least 0 and at most `end`; nothing if nowhere.
std::optional<double> enter(const Aabb& box,
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
  if (low > high) return std::nullopt;
  return low;
}

}  // namespace

ShapeTree::ShapeTree(const std::vector<Shape>& shapes) : shapes_(shapes), order_(shapes.size()) {
  std::iota(order_.begin(), order_.end(), 0u);
  boxes_.reserve(shapes.size());
  for (const Shape& shape : shapes) {
    Aabb box = bounds(shape);
    // flat shapes have flat boxes: room for rounding
    const Vector3d room = Vector3d::Constant(1e-9) + 1e-12 * box.max.cwiseAbs();
    box.min -= room;
    box.max += room;
    boxes_.push_back(box);
  }
  if (!shapes.empty()) build(0, static_cast<std::uint32_t>(shapes.size()));
}

void ShapeTree::build(std::uint32_t begin, std::uint32_t end) {
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
  if (end - begin <= kLeafShapes) {
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

std::optional<ShapeTree::Hit> ShapeTree::intersect(const Vector3d& origin,
                                                   const Vector3d& direction) const {
  if (nodes_.empty()) return std::nullopt;
  Vector3d inverse;
  for (int axis = 0; axis < 3; ++axis) {
    const double d = direction[axis];
    inverse[axis] = 1.0 / (std::abs(d) > 1e-300 ? d : 1e-300);
  }
  std::optional<Hit> met;
  double end = std::numeric_limits<double>::infinity();
  std::array<std::uint32_t, 64> stack{};  // halves of up to 2^32 shapes
  std::size_t depth = 0;
  stack[depth++] = 0;
  while (depth > 0) {
    const Node& node = nodes_[stack[--depth]];
    if (!enter(node.box, origin, inverse, end)) continue;
    if (node.count == 0) {
      // the side that the ray comes to first on top
      const std::uint32_t left = static_cast<std::uint32_t>(&node - nodes_.data()) + 1;
      const Vector3d way = (nodes_[node.first].box.min + nodes_[node.first].box.max) -
                           (nodes_[left].box.min + nodes_[left].box.max);
      const bool left_first = way.dot(direction) >= 0.0;
      stack[depth++] = left_first ? node.first : left;
      stack[depth++] = left_first ? left : node.first;
      continue;
    }
    for (std::uint32_t i = node.first; i < node.first + node.count; ++i) {
      const std::uint32_t shape = order_[i];
      const auto t = pointflight::intersect(shapes_[shape], origin, direction);
      if (t && *t < end) {
        end = *t;
        met = Hit{*t, shape};
      }
    }
  }
  return met;
}

}  // namespace pointflight
