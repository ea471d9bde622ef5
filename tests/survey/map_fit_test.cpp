// Maps fitted to the rays of their survey.
#include "pointflight/survey/map_fit.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "pointflight/core/constants.hpp"
#include "pointflight/core/random.hpp"
#include "pointflight/render/internal/all_hits_kernel.hpp"
#include "pointflight/render/renderer.hpp"
#include "tests/support.hpp"

namespace pointflight {
namespace {

using testing::map_of;

/// A survey held in memory, in batches.
class Rays : public SurveyReader {
 public:
  explicit Rays(const std::vector<SurveyRay>& rays, bool backwards = false)
      : rays_(rays), backwards_(backwards) {}
  bool read(std::vector<SurveyRay>& batch) override {
    constexpr std::size_t kSome = 7000;  // several chunks for threads to share
    batch.clear();
    for (; next_ < rays_.size() && batch.size() < kSome; ++next_) {
      batch.push_back(rays_[backwards_ ? rays_.size() - 1 - next_ : next_]);
    }
    return !batch.empty();
  }
  [[nodiscard]] double share_read() const override {
    return static_cast<double>(next_) / static_cast<double>(rays_.size());
  }

 private:
  const std::vector<SurveyRay>& rays_;
  bool backwards_;
  std::size_t next_ = 0;
};

SurveyRay ray_between(const Vector3d& from, const Vector3d& to, bool is_return = true) {
  return survey_ray({Quaterniond::Identity(), from}, to - from, is_return);
}

std::shared_ptr<const SurfelMap> opened(const EditedMap& map) {
  return SurfelMap::from_bytes(map_bytes(map.tree, map.description), "fitted");
}

std::shared_ptr<const SurfelMap> fitted(const SurfelMap& map,
                                        const std::vector<SurveyRay>& rays,
                                        FitReport& report,
                                        int threads = 2,
                                        bool backwards = false) {
  return opened(fit_map(
      map,
      [&] { return std::make_unique<Rays>(rays, backwards); },
      {},
      {},
      Executor(threads),
      report));
}

float range_in(const SurfelMap& map, const Vector3d& from, const Vector3d& to) {
  const auto whole = std::shared_ptr<const SurfelMap>(&map, [](const SurfelMap*) {});
  const auto renderer = make_renderer("beam", Scene{whole});
  return renderer->trace({from, (to - from).normalized().cast<float>(), 30.0f}).range;
}

/// A wall at x = 4, 4 x 4 m, and somebody at x = 2 who had gone when the rays were shot.
ShapeScene wall_and_ghost() {
  ShapeScene scene;
  scene.add_rectangle({4, -2, -2}, {0, 4, 0}, {0, 0, 4});
  scene.shapes.emplace_back(SceneSphere{{2, 0, 0}, 0.3});
  return scene;
}

std::vector<SurveyRay> rays_at_the_wall(std::size_t count) {
  const RandomStream random(4, StreamId::kTest, 0);
  std::vector<SurveyRay> rays;
  for (std::size_t i = 0; i < count; ++i) {
    const auto [u, v] = random.uniform2(i);
    rays.push_back(ray_between(Vector3d::Zero(), {4.0, 3.9 * u - 1.95, 3.9 * v - 1.95}));
  }
  return rays;
}

double farthest_from(const Vector3d& center, const std::vector<Vector3d>& points) {
  double farthest = 0.0;
  for (const Vector3d& p : points) farthest = std::max(farthest, (p - center).norm());
  return farthest;
}

TEST(MapFit, TakesOutWhatMovedAndKeepsTheRest) {
  const auto map = map_of(wall_and_ghost(), 0.1);
  ASSERT_LT(range_in(*map, {0, 0, 0}, {4, 0, 0}), 1.8f);
  FitReport report;
  const auto after = fitted(*map, rays_at_the_wall(40000), report);
  EXPECT_NEAR(range_in(*after, {0, 0, 0}, {4, 0, 0}), 4.0, 0.05);
  // its far half was never seen from behind: rays pass it as well
  EXPECT_GT(report.ghosts.size(), 80u);
  EXPECT_LT(farthest_from({2, 0, 0}, report.ghosts), 0.4);
  EXPECT_GT(report.before.early, 500u);
  EXPECT_LT(report.between.early, 40u);
  EXPECT_EQ(report.before.returns, 40000u);
  EXPECT_EQ(report.before.right + report.before.early + report.before.leaks, 40000u);
  EXPECT_LT(report.between.leaks, 100u) << "the wall stays tight";
  EXPECT_EQ(report.rays, 40000u);
}

TEST(MapFit, ShotsWithoutAReturnAreFreeUpToTheirEnd) {
  const auto map = map_of(wall_and_ghost(), 0.1);
  std::vector<SurveyRay> rays;
  for (const SurveyRay& ray : rays_at_the_wall(40000)) {
    const Vector3d end = ray.point_world();
    // through the ball; up to before it
    rays.push_back(ray_between(ray.origin_world, end * 0.9, false));
  }
  FitReport report;
  const auto after = fitted(*map, rays, report);
  EXPECT_EQ(report.before.empty, 40000u);
  EXPECT_GT(report.before.stopped, 500u);
  EXPECT_NEAR(range_in(*after, {0, 0, 0}, {4, 0, 0}), 4.0, 0.05);
  for (SurveyRay& ray : rays) ray.range = 1.5f;  // says nothing of the ball
  const auto same = fitted(*map, rays, report);
  EXPECT_EQ(report.before.stopped, 0u);
  EXPECT_LT(range_in(*same, {0, 0, 0}, {4, 0, 0}), 1.8f);
}

TEST(MapFit, TheSameBytesForAnyThreadsAndAnyOrder) {
  ShapeScene scene = wall_and_ghost();
  scene.shapes.emplace_back(Cone{{3, -1, -2}, {3, -1, 2}, 0.03, 0.03});
  const auto map = map_of(scene, 0.1, 6.0, 0.01);
  const auto rays = rays_at_the_wall(24000);
  FitReport report;
  const auto bytes = [&](int threads, bool backwards) {
    const EditedMap fit = fit_map(
        *map,
        [&] { return std::make_unique<Rays>(rays, backwards); },
        {},
        {},
        Executor(threads),
        report);
    return map_bytes(fit.tree, fit.description);
  };
  const auto one = bytes(1, false);
  EXPECT_EQ(one, bytes(2, false));
  EXPECT_EQ(one, bytes(5, false));
  EXPECT_EQ(one, bytes(2, true));
}

/// Axes and sizes of all surfels, sorted: leaves may have another origin.
std::vector<std::uint64_t> forms_of(const SurfelMap& map) {
  std::vector<std::uint64_t> forms;
  for_each_surfel(map.words(), [&](const LeafHeader&, std::size_t word) {
    forms.push_back(map.words()[word] >> 30);
  });
  std::sort(forms.begin(), forms.end());
  return forms;
}

TEST(MapFit, WhatNoRayMeetsKeepsEveryBit) {
  const auto map = map_of(wall_and_ghost(), 0.1);
  FitReport report;
  const auto after = fitted(*map, {ray_between({0, 0, -50}, {1, 0, -50})}, report);
  EXPECT_EQ(report.unseen, map->surfel_count());
  ASSERT_EQ(after->surfel_count(), map->surfel_count());
  EXPECT_EQ(forms_of(*after), forms_of(*map));
}

TEST(MapFit, WritesDownWhichSpaceRaysCrossed) {
  const auto map = map_of(wall_and_ghost(), 0.1);
  FitReport report;
  const auto after = fitted(*map, rays_at_the_wall(40000), report);
  ASSERT_NE(after->known_space(), nullptr);
  EXPECT_TRUE(after->known_space()->known({2.0, 0.0, 0.0})) << "where the ghost was";
  EXPECT_TRUE(after->known_space()->known({3.95, 1.0, 1.0})) << "the wall";
  EXPECT_FALSE(after->known_space()->known({0.5, 1.9, 1.9})) << "beside the rays";
  // another survey, from another side, adds to it
  std::vector<SurveyRay> rays;
  for (int i = -19; i < 20; ++i) rays.push_back(ray_between({0, 1.9, 1.9}, {4, 0.1 * i, 1.9}));
  const auto both = fitted(*after, rays, report);
  EXPECT_TRUE(both->known_space()->known({0.5, 1.9, 1.9}));
  EXPECT_TRUE(both->known_space()->known({2.0, 0.0, 0.0}));
}

TEST(MapFit, NothingLeftIsAnErrorOfOneLine) {
  ShapeScene scene;
  scene.shapes.emplace_back(SceneSphere{{2, 0, 0}, 0.3});
  const auto map = map_of(scene, 0.1);
  std::vector<SurveyRay> rays;
  for (const Vector3d& from : {Vector3d(0, 0, 0), Vector3d(2, 2, 0), Vector3d(2, 0, 2)}) {
    const RandomStream random(4, StreamId::kTest, 0);
    for (std::uint64_t i = 0; i < 20000; ++i) {
      const auto [u, v] = random.uniform2(2 * i);
      const double w = random.uniform(2 * i + 1);
      const Vector3d to = Vector3d(2, 0, 0) + 0.9 * (Vector3d(u, v, w) - Vector3d::Constant(0.5));
      rays.push_back(ray_between(from, from + 3.0 * (to - from)));
    }
  }
  FitReport report;
  const std::string error = testing::error_of([&] { fitted(*map, rays, report); });
  testing::expect_contains(error, "nothing is left");
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
  const auto map = map_of(wall_and_ghost(), 0.15, 12.0, 0.01);
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
  EXPECT_EQ(find_all_hits(kernel_map_of(*map), rays, order, visit), 0u);
  EXPECT_EQ(seen, rays.size());
  EXPECT_GT(far_behind, 20u) << "the wall behind the ball";
}

TEST(MeetAll, AnEmptyMapAndNoRays) {
  const auto map = map_of(std::vector<Vector3d>{{1, 2, 3}}, 0.1);
  std::vector<Ray> rays = {{Vector3d::Zero(), Vector3f::UnitX(), 5.0f}};
  const std::vector<std::uint32_t> order = {0};
  std::size_t seen = 0;
  find_all_hits(kernel_map_of(*map), rays, {}, [&](const RayHits&) { ++seen; });
  EXPECT_EQ(seen, 0u);
  find_all_hits(kernel_map_of(*map), rays, order, [&](const RayHits& way) {
    ++seen;
    EXPECT_LT(way.range, 0.0f);
    EXPECT_TRUE(way.hits.empty());
  });
  EXPECT_EQ(seen, 1u);
  KernelMap empty = kernel_map_of(*map);
  empty.node_count = 0;
  find_all_hits(empty, rays, order, [&](const RayHits& way) {
    ++seen;
    EXPECT_LT(way.range, 0.0f);
  });
  EXPECT_EQ(seen, 2u);
}

}  // namespace
}  // namespace pointflight
