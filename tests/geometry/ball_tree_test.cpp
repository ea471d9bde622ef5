#include "pointflight/geometry/internal/ball_tree.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace pointflight {
namespace {

TEST(BallTree, FindsWhatBruteForceFinds) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> place(-50.0, 50.0);
  std::uniform_real_distribution<double> size(0.0, 3.0);
  for (const std::size_t count : {0, 1, 7, 8, 9, 500, 3000}) {
    SCOPED_TRACE(count);
    std::vector<BoundingBall> balls;
    for (std::size_t i = 0; i < count; ++i) {
      balls.push_back({{place(random), place(random), 0.2 * place(random)}, size(random)});
      if (i % 5 == 0) balls.back() = balls[i / 2];  // many at one place
      if (i == 11) balls.back().radius = 200.0;     // one that is everywhere
    }
    const BallTree tree(balls);
    for (int k = 0; k < 200; ++k) {
      const Vector3d from(place(random), place(random), place(random));
      const double reach = 5.0 * size(random);
      std::vector<std::uint32_t> wanted;
      for (std::uint32_t i = 0; i < balls.size(); ++i) {
        if ((balls[i].center - from).norm() <= reach + balls[i].radius) wanted.push_back(i);
      }
      ASSERT_EQ(tree.within(from, reach), wanted);
    }
  }
}

}  // namespace
}  // namespace pointflight
