#include "pointflight/geometry/internal/box_tree.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <random>

namespace pointflight {
namespace {

/// True if a ray is in the box somewhere: its slabs have a part in common.
bool passes(const Aabb& box, const Vector3d& origin, const Vector3d& direction, double end) {
  double low = 0.0;
  double high = end;
  for (int axis = 0; axis < 3; ++axis) {
    const double a = (box.min[axis] - origin[axis]) / direction[axis];
    const double b = (box.max[axis] - origin[axis]) / direction[axis];
    low = std::max(low, std::min(a, b));
    high = std::min(high, std::max(a, b));
  }
  return low <= high;
}

std::vector<Aabb> many_boxes(std::size_t count, std::mt19937& random) {
  std::uniform_real_distribution<double> place(-50.0, 50.0);
  std::uniform_real_distribution<double> size(0.0, 3.0);
  std::vector<Aabb> boxes;
  for (std::size_t i = 0; i < count; ++i) {
    const Vector3d center(place(random), place(random), 0.2 * place(random));
    const Vector3d half(size(random), size(random), size(random));
    boxes.push_back({center - half, center + half});
    if (i % 5 == 0) boxes.back() = boxes[i / 2];  // many at one position
    if (i == 11) boxes.back() = {Vector3d::Constant(-200.0), Vector3d::Constant(200.0)};
  }
  return boxes;
}

TEST(BoxTree, FindsWhatBruteForceFinds) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> place(-50.0, 50.0);
  for (const std::size_t count : {0, 1, 3, 4, 5, 500, 3000}) {
    SCOPED_TRACE(count);
    const std::vector<Aabb> boxes = many_boxes(count, random);
    const BoxTree tree(boxes);
    for (int k = 0; k < 200; ++k) {
      const Vector3d from(place(random), place(random), place(random));
      const double reach = 0.1 * (50.0 + place(random));
      std::vector<std::uint32_t> near;
      std::vector<std::uint32_t> passed;
      const Vector3d direction = Vector3d(place(random), place(random), 1.0).normalized();
      const double end = k % 2 == 0 ? 30.0 : std::numeric_limits<double>::infinity();
      for (std::uint32_t i = 0; i < boxes.size(); ++i) {
        const Vector3d nearest = from.cwiseMax(boxes[i].min).cwiseMin(boxes[i].max);
        if ((nearest - from).norm() <= reach) near.push_back(i);
        if (passes(boxes[i], from, direction, end)) passed.push_back(i);
      }
      ASSERT_EQ(tree.within(from, reach), near);
      std::vector<std::uint32_t> visited;
      tree.along(from, direction, end, [&](std::uint32_t i) { visited.push_back(i); });
      std::ranges::sort(visited);
      ASSERT_TRUE(std::ranges::includes(visited, passed));
      ASSERT_TRUE(std::ranges::adjacent_find(visited) == visited.end()) << "visited twice";
    }
  }
}

}  // namespace
}  // namespace pointflight
