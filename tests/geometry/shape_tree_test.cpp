#include "pointflight/geometry/internal/shape_tree.hpp"

#include <gtest/gtest.h>

#include "pointflight/core/random.hpp"

namespace pointflight {
namespace {

Vector3d random_point(const RandomStream& random, std::uint64_t i) {
  const auto [x, y] = random.uniform2(2 * i);
  return {10.0 * x, 10.0 * y, 10.0 * random.uniform(2 * i + 1)};
}

/// Shapes of all kinds, some of them flat along an axis.
std::vector<Shape> many_shapes() {
  const RandomStream random(7, StreamId::kTest, 1);
  std::vector<Shape> shapes;
  std::uint64_t k = 0;
  for (int i = 0; i < 100; ++i) {
    const Vector3d p = random_point(random, k++);
    const Vector3d q = p + 0.2 * random_point(random, k++) - Vector3d::Constant(1.0);
    shapes.emplace_back(Triangle{p, q, random_point(random, k++)});
    shapes.emplace_back(Cone{p, q, 0.3, 0.02});
    shapes.emplace_back(Disc{p, (q - p).normalized(), 0.4});
    shapes.emplace_back(Disc{q, Vector3d::UnitZ(), 0.4});
    shapes.emplace_back(SceneSphere{q, 0.2});
  }
  return shapes;
}

TEST(ShapeTree, EqualsBruteForce) {
  const ShapeScene scene{many_shapes()};
  const ShapeTree tree(scene.shapes);
  const RandomStream random(8, StreamId::kTest, 2);
  int met = 0;
  for (std::uint64_t i = 0; i < 5000; ++i) {
    const Vector3d o = random_point(random, 2 * i);
    Vector3d d = (random_point(random, 2 * i + 1) - Vector3d::Constant(5.0)).normalized();
    if (i % 10 == 0) d = Vector3d::Unit(static_cast<int>(i / 10 % 3));  // along the axes too
    const auto expected = scene.intersect(o, d);
    const auto found = tree.intersect(o, d);
    ASSERT_EQ(found.has_value(), expected.has_value()) << i;
    if (!found) continue;
    ++met;
    EXPECT_EQ(found->range, *expected);
    EXPECT_EQ(intersect(scene.shapes[found->shape], o, d), expected);
  }
  EXPECT_GT(met, 2000);
}

TEST(ShapeTree, BoxesHoldTheirShapes) {
  const RandomStream random(9, StreamId::kTest, 3);
  std::uint64_t k = 0;
  for (const Shape& shape : many_shapes()) {
    const Aabb box = bounds(shape);
    Aabb drawn;
    for (int i = 0; i < 400; ++i) {
      const auto [u, v] = random.uniform2(k++);
      drawn.add(point_on(shape, u, v));
    }
    EXPECT_TRUE((drawn.min.array() >= box.min.array() - 1e-9).all());
    EXPECT_TRUE((drawn.max.array() <= box.max.array() + 1e-9).all());
    // and not much more than that
    EXPECT_LT((box.size() - drawn.size()).maxCoeff(), 0.35 * (box.size().maxCoeff() + 0.1));
  }
}

TEST(ShapeTree, OfNothingMeetsNothing) {
  const std::vector<Shape> none;
  EXPECT_FALSE(ShapeTree(none).intersect({0, 0, 0}, Vector3d::UnitX()));
}

}  // namespace
}  // namespace pointflight
