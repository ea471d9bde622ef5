// Rays that start anywhere: what each hits is what it hits by itself.
#include "pointflight/render/ray_casting.hpp"

#include <gtest/gtest.h>

#include <stdexcept>
#include <vector>

#include "pointflight/core/random.hpp"
#include "tests/support.hpp"

namespace pointflight {
namespace {

/// Rays from positions in a room, so many from each.
std::vector<Ray> rays_in_room(std::size_t positions, std::size_t from_each) {
  const RandomStream random(1, StreamId::kTest, 0);
  std::vector<Ray> rays;
  for (std::size_t p = 0; p < positions; ++p) {
    const auto [x, y] = random.uniform2(2 * p);
    const Vector3d origin(8.0 * x - 4.0, 6.0 * y - 3.0, random.uniform(2 * p + 1));
    for (std::size_t i = 0; i < from_each; ++i) {
      const std::uint64_t draw = (1u << 20) + 2 * (p * from_each + i);
      const auto [a, b] = random.normal2(draw);
      Ray ray;
      ray.origin_world = origin;
      ray.direction_world = Vector3d(a, b, random.normal(draw + 1)).cast<float>().normalized();
      ray.range_max = 5.0f + static_cast<float>(i % 3);
      rays.push_back(ray);
    }
  }
  return rays;
}

TEST(RayCasting, EachRayHitsWhatItHitsByItself) {
  ShapeScene scene;
  scene.add_box({-5, -4, -1}, {5, 4, 2});
  scene.add_box({1, 1, -1}, {2, 2, 1});
  const auto renderer = make_renderer("beam", Scene{testing::map_of(scene, 0.1)});
  const Executor executor(2);
  struct Case {
    std::size_t positions, from_each;
  };
  for (const Case& c : {Case{1, 500}, Case{500, 1}, Case{40, 10}, Case{5, 200}, Case{1, 1}}) {
    const std::vector<Ray> rays = rays_in_room(c.positions, c.from_each);
    std::vector<Hit> hits(rays.size());
    cast_rays(*renderer, rays, hits, executor);
    for (std::size_t i = 0; i < rays.size(); ++i) {
      const Hit alone = renderer->trace(rays[i]);
      EXPECT_EQ(hits[i].range, alone.range);
      EXPECT_EQ(hits[i].surfel, alone.surfel);
    }
  }
}

TEST(RayCasting, NoRaysAreFineAndImagesAreRefused) {
  ShapeScene scene;
  scene.add_box({-5, -4, -1}, {5, 4, 2});
  const Scene room{testing::map_of(scene, 0.2)};
  const Executor executor(1);
  cast_rays(*make_renderer("beam", room), {}, {}, executor);
  const auto images = make_renderer("paper", room);
  EXPECT_THROW(cast_rays(*images, {}, {}, executor), std::invalid_argument);
}

}  // namespace
}  // namespace pointflight
