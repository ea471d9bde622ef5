// The kernel's text as C++ beside the processor's own renderer: no driver is needed.
#include <gtest/gtest.h>

#include <bit>
#include <cstring>
#include <numeric>

#include "pointflight/core/random.hpp"
#include "pointflight/gpu/internal/kernel_choice.hpp"
#include "pointflight/map/import/map_builder.hpp"
#include "pointflight/map/map_file.hpp"
#include "pointflight/render/internal/beam_kernel.hpp"
#include "tests/gpu/aimed_call.hpp"
#include "tests/gpu/kernel_as_cpp.hpp"
#include "tests/support.hpp"

namespace pointflight {
namespace {

/// Rays of the same map by both; how many the kernel left to the processor.
std::size_t expect_equal(const SurfelMap& map, const std::vector<Ray>& rays) {
  std::vector<std::uint32_t> order(rays.size());
  std::iota(order.begin(), order.end(), 0u);
  std::vector<KernelHit> expected(rays.size());
  const KernelMap kernel_map = kernel_map_of(map);
  const std::vector<MapRay> packed = map_rays(kernel_map, rays);
  trace_beams(kernel_map, packed, order, expected);
  device::KernelAsCpp kernel{};
  kernel.map = numbers_of(map);
  kernel.nodes = reinterpret_cast<const device::uvec4*>(map.nodes().data());
  kernel.words = reinterpret_cast<const device::uvec2*>(map.words().data());
  std::size_t left = 0;
  std::size_t hits = 0;
  std::size_t different = 0;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const device::DeviceHit hit = kernel.trace(std::bit_cast<device::DeviceRay>(packed[i]));
    if (hit.range == device::kTooMany) {
      ++left;
      continue;
    }
    const KernelHit& e = expected[i];
    const bool is_same = e.range < 0.0f ? hit.range == device::kNothing
                                        : hit.range == e.range && hit.cosine == e.cos_incidence &&
                                              hit.surfel == e.strongest;
    different += is_same ? 0 : 1;
    hits += e.range >= 0.0f ? 1 : 0;
  }
  EXPECT_EQ(different, 0u);
  EXPECT_GT(hits, rays.size() / 10);
  return left;
}

/// From anywhere in the map's bounds, or a little outside.
std::vector<Ray> rays_in(const SurfelMap& map, std::size_t count, float range_max) {
  const Aabb box = map.bounds_world();
  const RandomStream random(9, StreamId::kTest, 0);
  std::vector<Ray> rays;
  for (std::uint64_t i = 0; rays.size() < count; ++i) {
    Ray ray;
    for (int k = 0; k < 3; ++k) {
      const auto axis = static_cast<std::uint64_t>(k);
      ray.origin_world[k] = random.uniform(6 * i + axis, box.min[k] - 1.0, box.max[k] + 1.0);
    }
    const Vector3d d(random.normal(6 * i + 3), random.normal(6 * i + 4), random.normal(6 * i + 5));
    // some along the axes
    ray.direction_world = i % 16 == 0 ? Vector3f(Vector3f::Unit(static_cast<int>(i / 16 % 3)))
                                      : Vector3f(d.normalized().cast<float>());
    ray.range_max = range_max;
    rays.push_back(ray);
  }
  return rays;
}

TEST(GpuKernel, TrialSceneHasTheProcessorsBits) {
  EXPECT_LT(expect_equal(*trial_scene(), trial_rays(40000)), 40u);
  EXPECT_LT(expect_equal(*trial_scene(), rays_in(*trial_scene(), 20000, 3.0f)), 40u);
}

TEST(GpuKernel, RaysOfBeamsHaveTheProcessorsBits) {
  const KernelMap map = kernel_map_of(*trial_scene());
  constexpr std::uint32_t kBeams = 3000;
  const TrialAims trial = trial_aims(kBeams, 4);
  for (const AimedBeams& aim : trial.aims) {
    RayBatch batch;
    batch.aimed = &aim;
    const std::vector<MapRay> expected = map_rays(map, batch, Executor(1));
    const std::vector<std::uint32_t> given = testing::given_of(map, aim);
    device::KernelAsCpp kernel{};
    kernel.call.count = kBeams;
    kernel.call.beams = kBeams;
    kernel.call.has_origins = 1;
    kernel.given = given.data();
    kernel.beams = reinterpret_cast<const device::DeviceBeam*>(trial.beams->beams.data());
    for (std::uint32_t i = 0; i < kBeams; ++i) {
      const auto made = std::bit_cast<MapRay>(kernel.ray_of(i));
      ASSERT_EQ(std::memcmp(&made, &expected[i], sizeof made), 0) << i;
      ASSERT_EQ(kernel.place_of(i), i);
    }
  }
}

TEST(GpuKernel, ThinAndNoisyMapsHaveTheProcessorsBits) {
  ShapeScene scene;
  scene.add_rectangle({0, 0, 0}, {20, 0, 0}, {0, 20, 3});
  scene.add_box({5, 5, 0}, {6, 8, 4});
  const auto thin = testing::map_of(scene, 0.1, 1.0, 0.0);
  const auto noisy = testing::map_of(scene, 0.05, 10.0, 0.03);
  const auto coarse = testing::map_of(scene, 0.4, 20.0, 0.05);
  for (const auto& map : {thin, noisy, coarse}) {
    EXPECT_LT(expect_equal(*map, rays_in(*map, 20000, 50.0f)), 400u);
  }
}

TEST(GpuKernel, ARealPlaceHasTheProcessorsBits) {
  const std::string cloud = testing::shared_data("maps/drone_hall.pcd");
  SKIP_WITHOUT(cloud);
  ImportOptions options;
  options.resolution = 0.05;
  const ImportedMap made = import_clouds({{cloud}}, options, Executor(2));
  const auto map = SurfelMap::from_bytes(map_bytes(made.tree, made.description), "hall");
  EXPECT_LT(expect_equal(*map, rays_in(*map, 30000, 60.0f)), 300u);
}

TEST(GpuKernel, FarFromTheOriginAndOutsideOfTheMap) {
  const auto map = trial_scene();
  std::vector<Ray> rays = rays_in(*map, 3000, 1e6f);
  for (Ray& ray : rays) ray.origin_world -= 500.0 * ray.direction_world.cast<double>();
  expect_equal(*map, rays);
}

}  // namespace
}  // namespace pointflight
