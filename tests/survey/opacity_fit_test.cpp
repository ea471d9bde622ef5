#include "pointflight/survey/opacity_fit.hpp"

#include <gtest/gtest.h>

#include "pointflight/core/random.hpp"
#include "pointflight/map/edit/map_edit.hpp"
#include "tests/map/edited_map.hpp"
#include "tests/support.hpp"
#include "tests/survey/rays.hpp"

namespace pointflight {
namespace {

/// A curtain at x = 2 m before a wall at x = 4 m.
EditedMap curtain_and_wall() {
  ShapeScene scene;
  scene.add_rectangle({2, -1, -1}, {0, 2, 0}, {0, 0, 2});
  scene.add_rectangle({4, -2, -2}, {0, 4, 0}, {0, 0, 4});
  const auto map = testing::map_of(scene, 0.1);
  return crop_map(
      *map, [](const Vector3d&) { return true; }, {}, Executor(1));
}

/// Rays of which the curtain sends that share back.
std::vector<SurveyRay> rays_of_share(double share, std::size_t count) {
  const RandomStream random(4, StreamId::kTest, 0);
  std::vector<SurveyRay> rays;
  for (std::size_t i = 0; i < count; ++i) {
    const auto [u, v] = random.uniform2(2 * i);
    const double far = random.uniform(2 * i + 1) < share ? 2.0 : 4.0;
    const Vector3d way(1.0, 0.8 * u - 0.4, 0.8 * v - 0.4);
    rays.push_back(testing::ray_between(Vector3d::Zero(), far * way));
  }
  return rays;
}

std::shared_ptr<const SurfelMap> with_opacity(const std::vector<SurveyRay>& rays,
                                              int threads,
                                              bool backwards = false) {
  EditedMap map = curtain_and_wall();
  fit_opacity(
      map, [&] { return std::make_unique<testing::Rays>(rays, backwards); }, {}, Executor(threads));
  return testing::opened(map);
}

TEST(OpacityFit, FindsTheShareOfBeamsThatComesBack) {
  for (const double share : {0.15, 0.4, 0.75}) {
    const auto rays = rays_of_share(share, 60000);
    const auto map = with_opacity(rays, 2);
    double sum = 0.0;
    double count = 0.0;
    map->for_each_surfel([&](const Vector3d& p, const Vector3d&, double, std::uint32_t word) {
      const std::uint8_t opacity = map->notes().opacity(word);
      if (p.x() > 3.0) {
        EXPECT_EQ(opacity, Opacity::kOpaque);
      } else if (std::abs(p.y()) < 0.7 && std::abs(p.z()) < 0.7) {
        sum += Opacity::share(opacity);
        count += 1.0;
      }
    });
    ASSERT_GT(count, 50.0);
    EXPECT_NEAR(sum / count, share, 0.02);
  }
}

TEST(OpacityFit, IsTheSameForAnyThreadsAndOrder) {
  const auto rays = rays_of_share(0.5, 20000);
  const std::string hash = with_opacity(rays, 1)->hash();
  EXPECT_EQ(hash, with_opacity(rays, 2)->hash());
  EXPECT_EQ(hash, with_opacity(rays, 2, true)->hash());
}

TEST(OpacityFit, FewRaysAndFirmSurfacesChangeNothing) {
  EXPECT_FALSE(with_opacity(rays_of_share(0.5, 20), 1)->notes().has_opacity());
  EXPECT_FALSE(with_opacity(rays_of_share(1.0, 60000), 2)->notes().has_opacity());
}

// a ray without a return passes all that is nearer than where it was free
TEST(OpacityFit, RaysWithoutAReturnCount) {
  std::vector<SurveyRay> rays = rays_of_share(1.0, 30000);
  for (std::size_t i = 0; i < rays.size(); i += 2) {
    rays[i].is_return = false;
    rays[i].range = 3.0f;
  }
  EXPECT_TRUE(with_opacity(rays, 2)->notes().has_opacity());
}

}  // namespace
}  // namespace pointflight
