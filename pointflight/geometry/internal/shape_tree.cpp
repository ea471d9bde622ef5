#include "pointflight/geometry/internal/shape_tree.hpp"

#include <limits>

namespace pointflight {
namespace {

std::vector<Aabb> boxes_of(const std::vector<Shape>& shapes) {
  std::vector<Aabb> boxes;
  boxes.reserve(shapes.size());
  for (const Shape& shape : shapes) {
    Aabb box = bounds(shape);
    // flat shapes have flat boxes: room for rounding
    const Vector3d room = Vector3d::Constant(1e-9) + 1e-12 * box.max.cwiseAbs();
    box.min -= room;
    box.max += room;
    boxes.push_back(box);
  }
  return boxes;
}

}  // namespace

ShapeTree::ShapeTree(const std::vector<Shape>& shapes) : shapes_(shapes), tree_(boxes_of(shapes)) {}

std::optional<ShapeTree::Hit> ShapeTree::intersect(const Vector3d& origin,
                                                   const Vector3d& direction) const {
  std::optional<Hit> first;
  double end = std::numeric_limits<double>::infinity();
  tree_.along(origin, direction, end, [&](std::uint32_t shape) {
    const auto t = pointflight::intersect(shapes_[shape], origin, direction);
    if (!t || *t >= end) return;
    end = *t;
    first = Hit{*t, shape};
  });
  return first;
}

}  // namespace pointflight
