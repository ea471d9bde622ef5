// Everything that a ray hits, against brute force.
#include <gtest/gtest.h>

#include <map>

#include "pointflight/core/constants.hpp"
#include "pointflight/core/random.hpp"
#include "pointflight/render/internal/all_hits_kernel.hpp"
#include "tests/support.hpp"

namespace pointflight {
namespace {

using testing::map_of;

/// A wall at x = 4, 4 x 4 m, and a ball before it.
ShapeScene wall_and_ball() {
  ShapeScene scene;
  scene.add_rectangle({4, -2, -2}, {0, 4, 0}, {0, 0, 4});
  scene.shapes.emplace_back(SceneSphere{{2, 0, 0}, 0.3});
  return scene;
}

/// A ray's way by brute force over all surfels, in double.
std::map<std::uint32_t, std::pair<double, double>> met_by_force(const SurfelMap& map,
                                                                const Ray& ray) {
  std::map<std::uint32_t, std::pair<double, double>> met;  // word: t, weight
  const double r = map.resolution();
  const double m2 =
      static_cast<double>(map.model().support) * static_cast<double>(map.model().support);
  for_each_surfel(map.words(), [&](const LeafHeader& leaf, std::size_t word) {
    const Surfel surfel = decode(map.words()[word]);
    const Vector3d center = map.origin_world() + r * (Vector3d(leaf.x, leaf.y, leaf.z) +
                                                      surfel.center_voxels.cast<double>());
    Vector3d u;
    Vector3d v;
    for (int k = 0; k < 3; ++k) {
      const double s = r * static_cast<double>(surfel.s[k]);
      u[k] = surfel.axes.col(k).cast<double>().dot(center - ray.origin_world) / s;
      v[k] = surfel.axes.col(k).cast<double>().dot(ray.direction_world.cast<double>()) / s;
    }
    const double t = u.dot(v) / v.dot(v);
    const double q = (u - t * v).squaredNorm();
    if (q >= m2 || t < 0.0 || t > static_cast<double>(ray.range_max)) return;
    const double weight = 36.0 / (kPi * m2) * (1.0 - q / m2) * (1.0 - q / m2);
    met[static_cast<std::uint32_t>(word)] = {t, weight};
  });
  return met;
}

using MetByWord = std::map<std::uint32_t, std::pair<double, double>>;

/// At the rim of the support rounding decides, and there the weight is nothing.
void expect_same(const MetByWord& got, const MetByWord& truth) {
  constexpr double kRim = 1e-3;
  for (const auto& [word, at] : truth) {
    if (at.second < kRim) continue;
    const auto found = got.find(word);
    ASSERT_NE(found, got.end()) << word;
    EXPECT_NEAR(found->second.first, at.first, 2e-3);
    EXPECT_NEAR(found->second.second, at.second, 2e-2);
  }
  for (const auto& [word, at] : got) EXPECT_TRUE(at.second < kRim || truth.contains(word));
}

TEST(MeetAll, FindsWhatBruteForceFindsBehindSurfacesToo) {
  const auto map = map_of(wall_and_ball(), 0.15, 12.0, 0.01);
  const RandomStream random(8, StreamId::kTest, 0);
  std::vector<Ray> rays;
  std::vector<std::uint32_t> order;
  for (std::uint32_t i = 0; i < 200; ++i) {
    const auto [u, v] = random.uniform2(i);
    const Vector3d to(4.0, 3.0 * u - 1.5, 3.0 * v - 1.5);
    rays.push_back({Vector3d(0, 0.1, 0), to.normalized().cast<float>(), 6.0f});
    order.push_back(i);
  }
  std::size_t far_behind = 0;
  std::size_t seen = 0;
  const auto visit = [&](const RayHits& way) {
    ++seen;
    MetByWord got;
    for (const SurfelHit& met : way.hits) {
      got[met.word] = {static_cast<double>(met.t),
                       static_cast<double>(met.weight) / static_cast<double>(kWeightOne)};
      far_behind += way.range >= 0.0f && met.t > way.range + 1.0f ? 1 : 0;
    }
    expect_same(got, met_by_force(*map, rays[way.ray]));
  };
  const KernelMap kernel_map = kernel_map_of(*map);
  EXPECT_EQ(find_all_hits(kernel_map, map_rays(kernel_map, rays), order, visit), 0u);
  EXPECT_EQ(seen, rays.size());
  EXPECT_GT(far_behind, 20u) << "the wall behind the ball";
}

TEST(MeetAll, AnEmptyMapAndNoRays) {
  const auto map = map_of(std::vector<Vector3d>{{1, 2, 3}}, 0.1);
  const KernelMap kernel_map = kernel_map_of(*map);
  const std::vector<MapRay> rays = {
      map_ray(kernel_map, {Vector3d::Zero(), Vector3f::UnitX(), 5.0f})};
  const std::vector<std::uint32_t> order = {0};
  std::size_t seen = 0;
  find_all_hits(kernel_map, rays, {}, [&](const RayHits&) { ++seen; });
  EXPECT_EQ(seen, 0u);
  find_all_hits(kernel_map, rays, order, [&](const RayHits& way) {
    ++seen;
    EXPECT_LT(way.range, 0.0f);
    EXPECT_TRUE(way.hits.empty());
  });
  EXPECT_EQ(seen, 1u);
  KernelMap empty = kernel_map;
  empty.node_count = 0;
  find_all_hits(empty, rays, order, [&](const RayHits& way) {
    ++seen;
    EXPECT_LT(way.range, 0.0f);
  });
  EXPECT_EQ(seen, 2u);
}

}  // namespace
}  // namespace pointflight
