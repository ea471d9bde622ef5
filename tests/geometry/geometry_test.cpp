#include <gtest/gtest.h>

#include <cmath>

#include "pointflight/core/constants.hpp"
#include "pointflight/core/random.hpp"
#include "pointflight/geometry/internal/morton.hpp"
#include "pointflight/geometry/rotation.hpp"
#include "pointflight/geometry/shape_scene.hpp"

namespace pointflight {
namespace {

TEST(Rotation, RollPitchYawTurnTheAxesInOrder) {
  // yaw 90 deg: the body's x axis points to world y; pitch 90 deg: x points down
  EXPECT_TRUE(
      (quaternion_from_rpy(0, 0, kPi / 2) * Vector3d::UnitX()).isApprox(Vector3d::UnitY(), 1e-15));
  EXPECT_TRUE(
      (quaternion_from_rpy(0, kPi / 2, 0) * Vector3d::UnitX()).isApprox(-Vector3d::UnitZ(), 1e-15));
  EXPECT_TRUE(
      (quaternion_from_rpy(kPi / 2, 0, 0) * Vector3d::UnitY()).isApprox(Vector3d::UnitZ(), 1e-15));
}

TEST(Rotation, VectorAndQuaternionAreInverse) {
  const RandomStream random(1, StreamId::kTest, 0);
  for (std::uint64_t i = 0; i < 500; ++i) {
    SCOPED_TRACE(i);
    Vector3d v(random.uniform(3 * i, -1, 1),
               random.uniform(3 * i + 1, -1, 1),
               random.uniform(3 * i + 2, -1, 1));
    v *= 3.1 / std::max(1.0, v.norm());
    v *= std::pow(10.0, -static_cast<double>(i % 14));  // down to nothing
    EXPECT_TRUE(rotation_vector(quaternion_from_rotation_vector(v)).isApprox(v, 1e-12));
    const auto reference = Eigen::AngleAxisd(v.norm(), v.normalized()).toRotationMatrix();
    EXPECT_TRUE(quaternion_from_rotation_vector(v).toRotationMatrix().isApprox(reference, 1e-12));
  }
}

TEST(Rotation, WrapAngleKeepsDirection) {
  for (double a = -20.0; a < 20.0; a += 0.37) {
    const double w = wrap_angle(a);
    EXPECT_LE(w, kPi);
    EXPECT_GT(w, -kPi - 1e-12);
    EXPECT_NEAR(std::remainder(w - a, 2.0 * kPi), 0.0, 1e-12);
  }
}

TEST(Rotation, InterpolationMatchesSlerpBetweenPhysicsSteps) {
  const Quaterniond a = quaternion_from_rpy(0.3, -0.2, 1.0);
  const Quaterniond b = a * quaternion_from_rotation_vector({0.005, 0.002, -0.004});
  for (const double share : {0.0, 0.25, 0.5, 0.9, 1.0}) {
    EXPECT_LT(interpolate(a, b, share).angularDistance(a.slerp(share, b)), 2e-8);
  }
}

TEST(Pose, InverseUndoes) {
  const Pose T{quaternion_from_rpy(0.1, 0.2, 0.3), {1, 2, 3}};
  const Vector3d p(4, -5, 6);
  EXPECT_TRUE((T.inverse() * (T * p)).isApprox(p, 1e-14));
  EXPECT_TRUE(((T * T.inverse()) * p).isApprox(p, 1e-14));
}

TEST(Morton, EncodesAndDecodesAllBits) {
  const RandomStream random(2, StreamId::kTest, 0);
  for (std::uint64_t i = 0; i < 1000; ++i) {
    const auto bits = random.bits(i);
    const std::uint32_t x = bits[0] & 0x1fffff;
    const std::uint32_t y = bits[1] & 0x1fffff;
    const std::uint32_t z = bits[2] & 0x1fffff;
    const auto back = morton_decode(morton_encode(x, y, z));
    EXPECT_EQ(back[0], x);
    EXPECT_EQ(back[1], y);
    EXPECT_EQ(back[2], z);
  }
  EXPECT_EQ(morton_encode(1, 0, 0), 1u);
  EXPECT_EQ(morton_encode(0, 1, 0), 2u);
  EXPECT_EQ(morton_encode(0, 0, 1), 4u);
}

TEST(Shapes, RangesByHand) {
  const Vector3d o = Vector3d::Zero();
  const Vector3d x = Vector3d::UnitX();
  EXPECT_NEAR(*intersect(SceneSphere{{5, 0, 0}, 1}, o, x), 4.0, 1e-12);
  EXPECT_NEAR(*intersect(Disc{{3, 0.5, 0}, x, 0.6}, o, x), 3.0, 1e-12);
  EXPECT_FALSE(intersect(Disc{{3, 0.7, 0}, x, 0.6}, o, x));
  EXPECT_NEAR(*intersect(Triangle{{2, -1, -1}, {2, 1, -1}, {2, 0, 1}}, o, x), 2.0, 1e-12);
  EXPECT_NEAR(*intersect(Cone{{4, 0, -1}, {4, 0, 1}, 0.5, 0.5}, o, x), 3.5, 1e-12);
  EXPECT_NEAR(*intersect(Cone{{4, 0, -1}, {4, 0, 1}, 0.0, 1.0}, o, x), 3.5, 1e-12);
  EXPECT_FALSE(intersect(Cone{{4, 0, 0.1}, {4, 0, 1}, 0.5, 0.5}, o, x));
  // from inside, the far side
  EXPECT_NEAR(*intersect(SceneSphere{{0, 0, 0}, 2}, o, x), 2.0, 1e-12);
}

TEST(Shapes, SampledPointsLieOnTheSurfaceAndCountByArea) {
  ShapeScene scene;
  scene.shapes = {SceneSphere{{0, 0, 0}, 1.0},
                  Disc{{5, 0, 0}, Vector3d(1, 1, 0).normalized(), 0.5},
                  Cone{{0, 5, 0}, {0, 5, 2}, 0.5, 0.1},
                  Triangle{{0, 0, 5}, {1, 0, 5}, {0, 1, 6}}};
  double wanted = 0.0;
  for (const Shape& shape : scene.shapes) wanted += 1000.0 * area(shape);
  std::size_t count = 0;
  scene.sample(1000.0, 0.0, 1, [&](const Vector3d& p) {
    ++count;
    // a ray from outside towards the point meets a surface there
    double nearest = 1e9;
    for (const Shape& shape : scene.shapes) {
      for (const Vector3d& d : {Vector3d(0.6, 0.48, 0.64), Vector3d(-0.48, 0.64, 0.6)}) {
        const auto t = intersect(shape, p - 0.02 * d, d);
        if (t) nearest = std::min(nearest, std::abs(*t - 0.02));
      }
    }
    EXPECT_LT(nearest, 0.02);
  });
  EXPECT_NEAR(static_cast<double>(count), wanted, 2.0);
}

TEST(Shapes, TheForestHasTreesApartAndStaysInItsPlot) {
  ForestOptions options;
  options.size_x = 30;
  options.size_y = 20;
  const ShapeScene scene = make_forest(options);
  EXPECT_GT(scene.shapes.size(), 1000u);
  const ShapeScene again = make_forest(options);
  ASSERT_EQ(scene.shapes.size(), again.shapes.size());
  EXPECT_EQ(std::get<Triangle>(scene.shapes[7]).a, std::get<Triangle>(again.shapes[7]).a);
  // ground everywhere below
  EXPECT_TRUE(scene.intersect({15, 10, 30}, {0, 0, -1}));
}

}  // namespace
}  // namespace pointflight
