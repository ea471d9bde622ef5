#include "pointflight/map/surfel.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "pointflight/core/constants.hpp"
#include "pointflight/core/random.hpp"

namespace pointflight {
namespace {

Matrix3f random_axes(const RandomStream& random, std::uint64_t i) {
  Eigen::Quaternionf q(static_cast<float>(random.normal(4 * i)),
                       static_cast<float>(random.normal(4 * i + 1)),
                       static_cast<float>(random.normal(4 * i + 2)),
                       static_cast<float>(random.normal(4 * i + 3)));
  return q.normalized().toRotationMatrix();
}

TEST(SurfelWord, KeepsPlaceNormalAndSpread) {
  const RandomStream random(1, StreamId::kTest, 0);
  double worst_normal_deg = 0.0;
  double mean_normal_deg[2] = {0.0, 0.0};  // of volumes, of planar surfels
  double mean_off_plane = 0.0;             // planar ones, voxels
  int counts[2] = {0, 0};
  constexpr int kCount = 20000;
  for (std::uint64_t i = 0; i < kCount; ++i) {
    Surfel surfel;
    for (int axis = 0; axis < 3; ++axis) {
      surfel.center_voxels[axis] =
          static_cast<float>(random.uniform(3 * i + static_cast<std::uint64_t>(axis), 0, 15.99));
    }
    surfel.axes = random_axes(random, i + 100000);
    surfel.s[2] = static_cast<float>(random.uniform(i + 900000, 0.07, 1.7));
    surfel.s[1] = surfel.s[2] * static_cast<float>(random.uniform(i + 950000, 0.15, 1.0));
    surfel.s[0] = kThicknessClasses[i % 4];
    const Surfel back = decode(encode(surfel));
    const bool planar = i % 4 == 0;
    ++counts[planar ? 1 : 0];
    for (int axis = 0; axis < 3; ++axis) {
      // planar ones may lie a step beside the nearest, within their plane
      ASSERT_NEAR(back.center_voxels[axis],
                  surfel.center_voxels[axis],
                  (planar ? 1.5f : 0.5f) / 64.0f + 1e-5f);
      ASSERT_EQ(std::floor(back.center_voxels[axis]), std::floor(surfel.center_voxels[axis]));
    }
    if (planar) {
      const Vector3f off = back.center_voxels - surfel.center_voxels;
      mean_off_plane += static_cast<double>(std::abs(off.dot(surfel.axes.col(0))));
    }
    // renderer's design: mean 0.27, at most 0.82 deg, here with a margin for the worst case
    const float cosine = std::min(1.0f, std::abs(back.axes.col(0).dot(surfel.axes.col(0))));
    const double angle = std::acos(static_cast<double>(cosine)) / kDegree;
    worst_normal_deg = std::max(worst_normal_deg, angle);
    mean_normal_deg[planar ? 1 : 0] += angle;
    ASSERT_NEAR(back.s[2] / surfel.s[2], 1.0f, 0.07f);
    ASSERT_NEAR(back.s[1] / back.s[2], surfel.s[1] / surfel.s[2], 0.126f);
    ASSERT_EQ(back.s[0], surfel.s[0]);
    ASSERT_TRUE((back.axes * back.axes.transpose()).isIdentity(1e-2f));
  }
  EXPECT_LT(worst_normal_deg, 0.9);
  EXPECT_LT(mean_normal_deg[0] / counts[0], 0.3);
  // what no rounding by itself would reach
  EXPECT_LT(mean_normal_deg[1] / counts[1], 0.16);
  EXPECT_LT(mean_off_plane / counts[1], 0.0015);
}

TEST(SurfelWord, LeafHeadersKeepTheirNumbers) {
  const LeafHeader leaf{1048575, 0, 524288, 8};
  const LeafHeader back = decode_leaf(encode(leaf));
  EXPECT_EQ(back.x, leaf.x);
  EXPECT_EQ(back.y, leaf.y);
  EXPECT_EQ(back.z, leaf.z);
  EXPECT_EQ(back.count, leaf.count);
}

}  // namespace
}  // namespace pointflight
