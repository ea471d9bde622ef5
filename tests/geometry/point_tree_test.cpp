#include <gtest/gtest.h>

#include <limits>
#include <random>

#include "pointflight/geometry/internal/point_tree-inl.hpp"

namespace pointflight {
namespace {

TEST(PointTree, FindsWhatBruteForceFinds) {
  std::mt19937 random(3);
  std::uniform_real_distribution<float> along(-5.0f, 5.0f);
  const auto draw = [&] { return Vector3f(along(random), along(random), 0.2f * along(random)); };
  std::vector<Vector3f> points(2000);
  for (Vector3f& p : points) p = draw();
  PointTree<Vector3f> made(points);
  const PointTree<Vector3f> tree = std::move(made);  // it may be moved
  ASSERT_EQ(tree.points().size(), points.size());
  for (int k = 0; k < 200; ++k) {
    const Vector3d from = draw().cast<double>();
    const double radius = 0.02 * k;
    std::size_t count = 0;
    for (const Vector3f& p : points) count += (p.cast<double>() - from).norm() < radius ? 1 : 0;
    const auto near = tree.within(from, radius);
    ASSERT_EQ(near.size(), count);
    double last = 0.0;
    for (const auto& [index, squared] : near) {
      EXPECT_NEAR(squared, (points[index].cast<double>() - from).squaredNorm(), 1e-12);
      EXPECT_LE(last, squared);
      last = squared;
    }
    EXPECT_EQ(tree.has_within(from, radius, 16), count >= 16);
    EXPECT_TRUE(tree.has_within(from, radius, count));
    EXPECT_FALSE(tree.has_within(from, radius, count + 1));
  }
  for (std::size_t i = 0; i < 50; ++i) {
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t j = 0; j < points.size(); ++j) {
      const double squared = (points[j] - points[i]).cast<double>().squaredNorm();
      if (j != i) least = std::min(least, squared);
    }
    EXPECT_NEAR(tree.squared_spacing(i), least, 1e-6);
  }
}

}  // namespace
}  // namespace pointflight
