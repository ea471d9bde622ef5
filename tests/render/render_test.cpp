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
#include "pointflight/render/internal/paper_renderer.hpp"
#include "tests/render/coverage_reference.hpp"
#include "tests/render/rays.hpp"
#include "tests/support.hpp"

namespace pointflight {
namespace {

using testing::fan;
using testing::import_points;
using testing::map_of;
using testing::render;

struct Errors {
  double median = 0.0;
  double p95 = 0.0;
  double early = 0.0;  ///< Share of rays with a true return, more than 0.1 m too near.
  double leak = 0.0;   ///< Too far by 0.1 m, or missed.
  double false_returns = 0.0;
};

Errors compare(const ShapeScene& scene,
               const std::vector<Ray>& rays,
               const std::vector<Hit>& hits) {
  std::vector<double> errors;
  Errors result;
  double truths = 0.0;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const auto truth =
        scene.intersect(rays[i].origin_world, rays[i].direction_world.cast<double>());
    if (!truth) {
      result.false_returns += hits[i].is_return() ? 1.0 : 0.0;
      continue;
    }
    truths += 1.0;
    const double error = static_cast<double>(hits[i].range) - *truth;
    if (!hits[i].is_return() || error > 0.1) {
      result.leak += 1.0;
    } else if (error < -0.1) {
      result.early += 1.0;
    } else {
      errors.push_back(std::abs(error));
    }
  }
  std::sort(errors.begin(), errors.end());
  if (!errors.empty()) {
    result.median = errors[errors.size() / 2];
    result.p95 = errors[errors.size() * 95 / 100];
  }
  result.early /= std::max(1.0, truths);
  result.leak /= std::max(1.0, truths);
  result.false_returns /= static_cast<double>(rays.size());
  return result;
}

TEST(HitList, OneSurfelThatCoversEnoughIsAReturnAtItsDepth) {
  HitList list;
  list.add({5.0f, 0.5f, 1, 1});
  const auto result = list.evaluate(0.35f, 0.025f);
  ASSERT_TRUE(result);
  EXPECT_EQ(result->range, 5.0f);
}

TEST(HitList, WeightsAddUpWithinTheWindowOnly) {
  HitList list;
  list.add({5.02f, 0.2f, 2, 2});
  list.add({5.0f, 0.2f, 1, 1});
  list.add({6.0f, 0.3f, 3, 3});
  const auto near_pair = list.evaluate(0.35f, 0.025f);
  ASSERT_TRUE(near_pair);
  EXPECT_FLOAT_EQ(near_pair->range, 5.01f);
  EXPECT_FALSE(list.evaluate(0.35f, 0.01f));
  // a stray surfel in front does not stop the beam
  list.add({1.0f, 0.1f, 4, 4});
  EXPECT_FLOAT_EQ(list.evaluate(0.35f, 0.025f)->range, 5.01f);
}

TEST(BeamRenderer, Statistics_MeetsAPlaneAtItsExactRange) {
  ShapeScene scene;
  scene.add_rectangle({5, -10, -10}, {0, 20, 0}, {0, 0, 20});
  const BeamRenderer renderer(Scene{map_of(scene, 0.05)});
  const auto rays = fan({0, 0, 0}, 55, 40, 1.7);
  const Errors errors = compare(scene, rays, render(renderer, rays));
  EXPECT_LT(errors.median, 0.0005);
  EXPECT_LT(errors.p95, 0.002);
  EXPECT_EQ(errors.early, 0.0);
  EXPECT_LT(errors.leak, 0.001);
}

TEST(BeamRenderer, Statistics_GrazingBeamsStayOnTheFloor) {
  ShapeScene scene;
  scene.add_rectangle({-1, -5, 0}, {40, 0, 0}, {0, 10, 0});
  const BeamRenderer renderer(Scene{map_of(scene, 0.05)});
  std::vector<Ray> rays;
  for (double az = -8; az <= 8; az += 0.25) {
    for (const double el : {-3.0, -3.5, -5.0, -8.0}) {
      rays.push_back({{0, 0, 1}, direction_of(az * kDegree, el * kDegree).cast<float>(), 60.0f});
    }
  }
  const Errors errors = compare(scene, rays, render(renderer, rays));
  EXPECT_LT(errors.median, 0.009);
  EXPECT_LT(errors.early, 0.02);
}

TEST(BeamRenderer, SphereAndBoxWithinMillimetres) {
  ShapeScene scene;
  scene.shapes.emplace_back(SceneSphere{{6, 0, 0}, 1.5});
  scene.add_box({3, 3, -1}, {5, 5, 2});
  const BeamRenderer renderer(Scene{map_of(scene, 0.05)});
  const auto rays = fan({0, 0, 0.2}, 60, 30, 0.37);
  const Errors errors = compare(scene, rays, render(renderer, rays));
  EXPECT_LT(errors.median, 0.002);
  EXPECT_LT(errors.p95, 0.015);
  EXPECT_LT(errors.early, 0.02);
  EXPECT_LT(errors.leak, 0.005);
  // fat edges: at most half a cell around the outline
  EXPECT_LT(errors.false_returns, 0.01);
}

TEST(BeamRenderer, Statistics_ReportsTheAngleOfIncidence) {
  ShapeScene scene;
  scene.add_rectangle({5, -10, -10}, {0, 20, 0}, {0, 0, 20});
  const BeamRenderer renderer(Scene{map_of(scene, 0.05)});
  for (const double az_deg : {0.0, 20.0, 45.0, 60.0}) {
    const Hit hit =
        renderer.trace({{0, 0, 0}, direction_of(az_deg * kDegree, 0).cast<float>(), 50.0f});
    ASSERT_TRUE(hit.is_return());
    EXPECT_NEAR(hit.cos_incidence, std::cos(az_deg * kDegree), 0.02);
  }
}

TEST(BeamRenderer, AStartJustBeforeAWallSeesItAndOneBehindDoesNot) {
  ShapeScene scene;
  scene.add_rectangle({5, -3, -3}, {0, 6, 0}, {0, 0, 6});
  const BeamRenderer renderer(Scene{map_of(scene, 0.05)});
  for (const double gap : {0.001, 0.01, 0.03, 0.1}) {
    const Hit before = renderer.trace({{5.0 - gap, 0.01, 0.02}, Vector3f::UnitX(), 10.0f});
    ASSERT_TRUE(before.is_return()) << gap;
    EXPECT_NEAR(before.range, gap, 0.001);
    EXPECT_FALSE(renderer.trace({{5.0 + gap, 0.01, 0.02}, Vector3f::UnitX(), 10.0f}).is_return());
  }
}

TEST(BeamRenderer, EndsAtItsRange) {
  ShapeScene scene;
  scene.add_rectangle({5, -3, -3}, {0, 6, 0}, {0, 0, 6});
  const BeamRenderer renderer(Scene{map_of(scene, 0.05)});
  EXPECT_TRUE(renderer.trace({{0, 0, 0}, Vector3f::UnitX(), 5.01f}).is_return());
  EXPECT_FALSE(renderer.trace({{0, 0, 0}, Vector3f::UnitX(), 4.9f}).is_return());
}

/// The measurement model without a tree: every surfel is tested, in double precision.
Hit brute_force(const SurfelMap& map, const Ray& ray) {
  const double r = map.resolution();
  const double m2_max =
      static_cast<double>(map.model().support) * static_cast<double>(map.model().support);
  const double c = 36.0 / (kPi * m2_max);
  const Vector3d d = ray.direction_world.cast<double>();
  HitList list;
  for (std::size_t at = 0; at + kLeafPadding < map.words().size();) {
    const LeafHeader leaf = decode_leaf(map.words()[at]);
    for (std::size_t i = 1; i <= leaf.count; ++i) {
      const Surfel s = decode(map.words()[at + i]);
      const Vector3d center = map.origin_world() + r * (Vector3d(leaf.x, leaf.y, leaf.z) +
                                                        s.center_voxels.cast<double>());
      const Vector3d inverse = (r * s.s.cast<double>()).cwiseInverse();
      const Vector3d u =
          inverse.cwiseProduct(s.axes.cast<double>().transpose() * (center - ray.origin_world));
      const Vector3d v = inverse.cwiseProduct(s.axes.cast<double>().transpose() * d);
      const double t = u.dot(v) / v.squaredNorm();
      const double m2 = (u - t * v).squaredNorm();
      if (m2 >= m2_max || t < 0.0 || t > static_cast<double>(ray.range_max)) continue;
      const double share = 1.0 - m2 / m2_max;
      if (list.full()) list.drop_farthest();
      list.add({static_cast<float>(t),
                static_cast<float>(c * share * share),
                map.words()[at + i],
                static_cast<std::uint32_t>(at + i)});
    }
    at += leaf.count + 1;
  }
  const auto result = list.evaluate(map.model().tau, map.model().window * static_cast<float>(r));
  Hit hit;
  if (result) hit.range = result->range;
  return hit;
}

TEST(BeamRenderer, EqualsTheModelWithoutATree) {
  ShapeScene scene;
  scene.add_box({0, 0, 0}, {6, 5, 3});
  scene.shapes.emplace_back(SceneSphere{{3, 2, 1}, 0.6});
  scene.shapes.emplace_back(Cone{{1, 4, 0}, {1, 4, 3}, 0.05, 0.02});
  const auto map = map_of(scene, 0.1, 8.0, 0.01);
  const BeamRenderer renderer(Scene{map});
  const RandomStream random(1, StreamId::kTest, 0);
  int compared = 0;
  int differing = 0;
  for (std::uint64_t i = 0; i < testing::repeats(std::uint64_t{1500}); ++i) {
    Ray ray;
    ray.origin_world = {random.uniform(8 * i, 0.2, 5.8),
                        random.uniform(8 * i + 1, 0.2, 4.8),
                        random.uniform(8 * i + 2, 0.2, 2.8)};
    ray.direction_world =
        direction_of(random.uniform(8 * i + 3, -kPi, kPi), random.uniform(8 * i + 4, -1.5, 1.5))
            .cast<float>();
    if (i % 50 == 0) ray.direction_world = Vector3f::Unit(static_cast<int>(i / 50 % 3));
    ray.range_max = 20.0f;
    const Hit slow = brute_force(*map, ray);
    const Hit fast = renderer.trace(ray);
    ++compared;
    // a sum of weights within rounding of tau, or a hit at the edge of the window, may fall either
    // way between float and double
    const bool same = slow.is_return() == fast.is_return() &&
                      (!slow.is_return() || std::abs(slow.range - fast.range) < 2e-4f);
    differing += same ? 0 : 1;
  }
  EXPECT_LE(differing, compared / 500) << differing << " of " << compared;
}

TEST(BeamRenderer, Threads_DoesNotDependOnThreads) {
  ShapeScene scene;
  scene.add_box({-4, -4, -2}, {4, 4, 2});
  const BeamRenderer renderer(Scene{map_of(scene, 0.1, 6.0, 0.01)});
  const auto rays = fan({0, 0, 0}, 170, 60, 1.1);
  const auto one = render(renderer, rays, 1);
  for (const int threads : {2, 8}) {
    const auto many = render(renderer, rays, threads);
    EXPECT_EQ(hash64(as_bytes(one)), hash64(as_bytes(many)));
  }
}

/// All bits of what was met.
std::vector<std::uint32_t> bits_of(const std::vector<Hit>& hits) {
  std::vector<std::uint32_t> bits;
  for (const Hit& hit : hits) {
    for (const float value : {hit.range, hit.cos_incidence, hit.intensity}) {
      bits.push_back(std::bit_cast<std::uint32_t>(value));
    }
  }
  return bits;
}

TEST(BeamRenderer, Threads_TheSameBitsOnEveryInstructionSetAndInEveryOrder) {
  ShapeScene scene;
  scene.add_box({-4, -4, -2}, {4, 4, 2});
  scene.shapes.emplace_back(SceneSphere{{2, 2, 0}, 0.5});
  const BeamRenderer renderer(Scene{map_of(scene, 0.1, 6.0, 0.02)});
  auto rays = fan({0.3, 0.2, 0.1}, 179, 80, 0.9);
  const auto dense = fan({0.3, 0.2, 0.1}, 30, 20, 0.15);  // goes in packets
  rays.insert(rays.end(), dense.begin(), dense.end());
  for (std::size_t i = 0; i < rays.size(); ++i) {  // a moving sensor
    rays[i].origin_world.x() += 1e-5 * static_cast<double>(i);
  }
  ASSERT_GE(kernel_names().size(), 2u);
  const auto expected = bits_of(render(renderer, rays));
  for (const std::string& name : kernel_names()) {
    use_kernel(name);
    EXPECT_EQ(bits_of(render(renderer, rays)), expected) << name;
  }
  use_kernel("");
  const BeamRenderer singly(renderer.scene(), BeamGrouping::kSingly);
  EXPECT_EQ(bits_of(render(singly, rays)), expected);
  EXPECT_THROW(use_kernel("MMX"), InputError);
  std::vector<Hit> alone;
  for (std::size_t i = 0; i < rays.size(); i += 37) alone.push_back(renderer.trace(rays[i]));
  const auto bits = bits_of(alone);
  for (std::size_t i = 0; i < bits.size(); ++i) {
    ASSERT_EQ(bits[i], expected[i / 3 * 37 * 3 + i % 3]);
  }
}

TEST(BeamRenderer, TheShapeOfTheTreeDoesNotShow) {
  ShapeScene scene;
  scene.add_box({-4, -4, -2}, {4, 4, 2});
  scene.shapes.emplace_back(SceneSphere{{2, 2, 0}, 0.5});
  std::vector<CloudPoint> points;
  scene.sample(800.0, 0.01, 1, [&](const Vector3d& p) { points.push_back({p, 0.0f}); });
  ImportOptions options;
  options.resolution = 0.1;
  options.quality = TreeQuality::kNormal;
  const ImportedMap normal = import_points(points, options);
  options.quality = TreeQuality::kHigh;
  const ImportedMap high = import_points(points, options);
  EXPECT_EQ(normal.report.surfels, high.report.surfels);
  EXPECT_LT(high.tree.nodes.size(), 2 * normal.tree.nodes.size());
  const auto rays = fan({0.3, 0.2, 0.1}, 170, 70, 1.3);
  const auto map_from = [](const ImportedMap& map) {
    const auto opened = SurfelMap::from_bytes(map_bytes(map.tree, map.description), "memory");
    opened->verify();
    return opened;
  };
  const auto a = render(BeamRenderer(Scene{map_from(normal)}), rays);
  const auto b = render(BeamRenderer(Scene{map_from(high)}), rays);
  std::size_t differing = 0;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    // positions are rounded from another leaf's corner
    const bool same =
        a[i].is_return() == b[i].is_return() && std::abs(a[i].range - b[i].range) < 1e-4f;
    differing += same ? 0 : 1;
  }
  EXPECT_LE(differing, rays.size() / 1000);
}

TEST(BeamRenderer, BeamsAlongAWallDoNotOverflowUnseen) {
  // a corridor with beams nearly in its wall's plane: the longest lists of surfels
  ShapeScene scene;
  scene.add_rectangle({0, 0, -1}, {60, 0, 0}, {0, 0, 2});
  const BeamRenderer renderer(Scene{map_of(scene, 0.1)});
  std::vector<Ray> rays;
  for (int i = 0; i <= 200; ++i) {
    const double slope = (i - 100) * 2e-4;
    rays.push_back({{-1, 0.02, 0}, Vector3d(1, slope, 0).normalized().cast<float>(), 80.0f});
  }
  const auto hits = render(renderer, rays);
  EXPECT_EQ(renderer.overflow_count(), 0u);
  for (std::size_t i = 0; i < rays.size(); ++i) {
    if (!hits[i].is_return()) continue;
    const Vector3d p = rays[i].origin_world +
                       static_cast<double>(hits[i].range) * rays[i].direction_world.cast<double>();
    EXPECT_LT(std::abs(p.y()), 0.03);
  }
}

TEST(BeamRenderer, AnEmptyMapReturnsNothing) {
  Scratch scratch;
  const Bvh8 empty = build_bvh8({{}, {}}, TreeQuality::kNormal, Executor(1), scratch);
  MapDescription description;
  description.resolution = 0.1;
  const auto map = SurfelMap::from_bytes(map_bytes(empty, description), "empty");
  EXPECT_FALSE(BeamRenderer(Scene{map}).trace({{0, 0, 0}, Vector3f::UnitX(), 100.0f}).is_return());
}

TEST(BeamRenderer, ADamagedMapGivesWrongHitsAndNoHarm) {
  ShapeScene scene;
  scene.add_box({-4, -4, -2}, {4, 4, 2});
  std::vector<CloudPoint> points;
  scene.sample(600.0, 0.0, 1, [&](const Vector3d& p) { points.push_back({p, 0.0f}); });
  ImportOptions options;
  options.resolution = 0.2;
  const ImportedMap imported = testing::import_points(points, options);
  const auto good = map_bytes(imported.tree, imported.description);
  const RandomStream random(9, StreamId::kTest, 0);
  const auto rays = fan({0, 0, 0}, 170, 60, 9.0);
  for (std::uint64_t i = 0; i < 100; ++i) {
    auto bytes = good;
    for (std::uint64_t k = 0; k < 40; ++k) {
      const auto bits = random.bits(i * 100 + k);
      bytes[kMapHeaderSize + bits[0] % (good.size() - kMapHeaderSize)] =
          static_cast<std::byte>(bits[1]);
    }
    const BeamRenderer renderer(Scene{SurfelMap::from_bytes(bytes, "damaged")});
    render(renderer, rays, 1);
  }
}

TEST(Renderers, AnUnknownNameListsTheKnown) {
  testing::expect_contains(testing::error_of([] { make_renderer("gpu9", Scene{}); }),
                           "one of: beam, paper");
}

}  // namespace
}  // namespace pointflight
