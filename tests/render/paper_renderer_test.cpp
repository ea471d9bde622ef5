// The paper's renderer beside ours.
#include "pointflight/render/internal/paper_renderer.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>

#include "pointflight/core/constants.hpp"
#include "pointflight/core/hash.hpp"
#include "pointflight/core/output_file.hpp"
#include "pointflight/core/random.hpp"
#include "pointflight/lidar/beam_pattern.hpp"
#include "pointflight/render/internal/beam_renderer.hpp"
#include "tests/render/coverage_reference.hpp"
#include "tests/render/rays.hpp"
#include "tests/support.hpp"

namespace pointflight {
namespace {

using testing::fan;
using testing::map_of;
using testing::render;

class PaperAgainstBeam : public ::testing::Test {
 protected:
  /// Median difference if both return, and the shares of rays if only one does.
  struct Agreement {
    double median;
    double within;  ///< 0.1 m, of the rays if both return.
    double only_beam;
    double only_paper;
  };
  static Agreement agree(const ShapeScene& scene, const std::vector<Ray>& rays) {
    const auto map = map_of(scene, 0.05);
    const auto beam = render(BeamRenderer(Scene{map}), rays);
    const auto paper = render(PaperRenderer(Scene{map}, {}), rays);
    std::vector<double> differences;
    Agreement a{0, 0, 0, 0};
    for (std::size_t i = 0; i < rays.size(); ++i) {
      if (beam[i].is_return() && paper[i].is_return()) {
        differences.push_back(std::abs(static_cast<double>(beam[i].range - paper[i].range)));
        a.within += differences.back() < 0.1 ? 1.0 : 0.0;
      } else {
        a.only_beam += beam[i].is_return() ? 1.0 / static_cast<double>(rays.size()) : 0.0;
        a.only_paper += paper[i].is_return() ? 1.0 / static_cast<double>(rays.size()) : 0.0;
      }
    }
    std::sort(differences.begin(), differences.end());
    a.median = differences.at(differences.size() / 2);
    a.within /= static_cast<double>(differences.size());
    return a;
  }
};

TEST_F(PaperAgainstBeam, Statistics_OnAPlane) {
  ShapeScene scene;
  scene.add_rectangle({5, -10, -10}, {0, 20, 0}, {0, 0, 20});
  const Agreement a = agree(scene, fan({0, 0, 0}, 45, 30, 0.5));
  EXPECT_LT(a.median, 0.005);
  EXPECT_GT(a.within, 0.99);
  EXPECT_LT(a.only_beam + a.only_paper, 0.001);
}

TEST_F(PaperAgainstBeam, Statistics_OnAFloorAtGrazingAngles) {
  ShapeScene scene;
  scene.add_rectangle({-1, -12, 0}, {14, 0, 0}, {0, 24, 0});
  std::vector<Ray> rays;
  for (double az = -60; az < 60; az += 1.0) {
    for (double el = -40; el <= -4.9; el += 0.4) {  // centres of the image's pixels
      rays.push_back({{0, 0, 1.0}, direction_of(az * kDegree, el * kDegree).cast<float>(), 50.0f});
    }
  }
  const Agreement a = agree(scene, rays);
  EXPECT_LT(a.median, 0.01);
  EXPECT_GT(a.within, 0.99);
  EXPECT_LT(a.only_beam + a.only_paper, 0.005);
}

TEST_F(PaperAgainstBeam, OnASphereAndABox) {
  ShapeScene scene;
  scene.shapes.emplace_back(SceneSphere{{6, 0, 0}, 1.5});
  scene.add_box({3, 3, -1}, {5, 5, 2});
  const Agreement a = agree(scene, fan({0, 0, 0.2}, 60, 30, 0.5));
  EXPECT_LT(a.median, 0.01);
  EXPECT_GT(a.within, 0.97);
  EXPECT_LT(a.only_beam, 0.002);
  // the paper's facing discs of sqrt(3)/2 r draw outlines fatter
  EXPECT_LT(a.only_paper, 0.01);
}

TEST_F(PaperAgainstBeam, Statistics_AllAroundAndAcrossTheRear) {
  ShapeScene scene;
  scene.add_box({-4, -4, -2}, {4, 4, 2});
  const Agreement a = agree(scene, fan({0.3, -0.2, 0.1}, 179.9, 45, 0.7));
  EXPECT_LT(a.median, 0.01);
  EXPECT_GT(a.within, 0.99);
  EXPECT_LT(a.only_beam + a.only_paper, 0.002);
}

TEST(PaperRenderer, Threads_DoesNotDependOnThreads) {
  ShapeScene scene;
  scene.add_box({-4, -4, -2}, {4, 4, 2});
  const PaperRenderer renderer(Scene{map_of(scene, 0.1, 6.0, 0.01)}, {});
  const auto rays = fan({0, 0, 0}, 170, 60, 1.1);
  const auto one = render(renderer, rays, 1);
  for (const int threads : {2, 8}) {
    EXPECT_EQ(hash64(as_bytes(one)), hash64(as_bytes(render(renderer, rays, threads))));
  }
}

}  // namespace
}  // namespace pointflight
