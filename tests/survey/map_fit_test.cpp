// Maps fitted to the rays of their survey.
#include "pointflight/survey/map_fit.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "pointflight/core/random.hpp"
#include "pointflight/render/renderer.hpp"
#include "pointflight/survey/internal/reshaped_surfel.hpp"
#include "pointflight/survey/surface_share.hpp"
#include "pointflight/survey/survey_map.hpp"
#include "tests/support.hpp"
#include "tests/survey/rays.hpp"

namespace pointflight {
namespace {

using testing::map_of;
using testing::ray_between;
using testing::Rays;

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

/// A wall at x = 4 up to y = 0, and rays from the origin at and beside its edge: those beside it
/// end at a wall 2 m behind.
std::vector<SurveyRay> rays_at_an_edge(std::size_t count, std::uint64_t seed) {
  const RandomStream random(seed, StreamId::kTest, 0);
  std::vector<SurveyRay> rays;
  for (std::size_t i = 0; i < count; ++i) {
    const auto [u, v] = random.uniform2(i);
    const Vector3d to(4.0, 0.3 * u - 0.15, 1.8 * v - 0.9);
    rays.push_back(ray_between(Vector3d::Zero(), to.y() < 0.0 ? to : 1.5 * to));
  }
  return rays;
}

double right_share(const SurfelMap& map, const std::vector<SurveyRay>& rays) {
  const auto survey = [&] { return std::make_unique<Rays>(rays); };
  return measure_rays(map, survey, 0.1, {}, Executor(2)).right_share();
}

std::shared_ptr<const SurfelMap> fitted_by(const FitOptions& fit,
                                           const SurfelMap& map,
                                           const std::vector<SurveyRay>& rays) {
  FitReport report;
  return opened(fit_map(
      map, [&] { return std::make_unique<Rays>(rays); }, fit, {}, Executor(2), report));
}

TEST(MapFit, CentresMoveAwayFromWhereRaysPass) {
  ShapeScene scene;
  scene.add_rectangle({4, -2, -1}, {0, 2.03, 0}, {0, 0, 2});  // poses were off by 3 cm
  scene.add_rectangle({6, -3, -2}, {0, 6, 0}, {0, 0, 4});
  const auto map = map_of(scene, 0.1);
  const auto survey = rays_at_an_edge(20000, 4);
  const auto others = rays_at_an_edge(20000, 5);
  FitOptions still;
  still.shift_step = 0.0;
  const double before = right_share(*map, others);
  const double resized = right_share(*fitted_by(still, *map, survey), others);
  const double moved = right_share(*fitted_by({}, *map, survey), others);
  EXPECT_GT(resized, before);
  EXPECT_GT(moved, resized + 0.01) << before << ", " << resized << ", " << moved;
}

/// Rays at a trunk, 0.3 m thick and 3 m away: its half that the origin sees.
std::vector<SurveyRay> rays_at_a_trunk(std::size_t count, std::uint64_t seed) {
  const RandomStream random(seed, StreamId::kTest, 0);
  std::vector<SurveyRay> rays;
  for (std::size_t i = 0; i < count; ++i) {
    const auto [u, v] = random.uniform2(i);
    const double angle = 2.4 * (u - 0.5);
    const Vector3d to(3.0 - 0.3 * std::cos(angle), 0.3 * std::sin(angle), 1.8 * v - 0.9);
    rays.push_back(ray_between(Vector3d::Zero(), to));
  }
  return rays;
}

TEST(MapFit, WhereReturnsAreFewOthersDoNotGetThrough) {
  const auto survey = rays_at_a_trunk(300, 9);
  std::vector<Vector3d> points;
  for (const SurveyRay& ray : survey) points.push_back(ray.point_world());
  const auto map = map_of(points, 0.06);
  const auto others = rays_at_a_trunk(20000, 10);
  FitOptions as_returned;
  as_returned.expected_leaks = 0.0;
  const double without = 1.0 - right_share(*fitted_by(as_returned, *map, survey), others);
  const double with = 1.0 - right_share(*fitted_by({}, *map, survey), others);
  EXPECT_GT(without, 0.02);
  EXPECT_LT(with, 0.7 * without) << without << ", " << with;
}

TEST(MapFit, AReshapedSurfelStaysInItsVoxelAndInItsPlane) {
  const auto map = map_of(wall_and_ghost(), 0.1);
  std::size_t seen = 0;
  for_each_surfel(map->words(), [&](const LeafHeader&, std::size_t at) {
    const SurfelWord word = map->words()[at];
    EXPECT_EQ(reshaped(word, {}), word);
    const Surfel before = decode(word);
    const SurfelWord changed =
        reshaped(word, {.factors = {1.0, 0.8, 1.3}, .shifts = {0.0, 0.6, -0.7}});
    const Surfel after = decode(changed);
    for (int k = 0; k < 3; ++k) {
      EXPECT_EQ(std::floor(before.center_voxels[k]), std::floor(after.center_voxels[k]));
    }
    EXPECT_EQ(is_planar(word), is_planar(changed));
    EXPECT_LE(after.s[2], 1.9f);
    const Vector3f way = after.center_voxels - before.center_voxels;
    const float full = (before.s.tail<2>().array() * Eigen::Array2f(0.6f, -0.7f)).matrix().norm();
    EXPECT_LE(way.norm(), full + 0.03f);
    if (is_planar(word) && (way.norm() > 0.9f * full)) {
      EXPECT_LT(std::abs(way.dot(before.axes.col(0))), 0.03f);
      ++seen;
    }
  });
  EXPECT_GT(seen, 20u);
}

TEST(MapFit, EveryPieceOfSurfaceHasOneVote) {
  ShapeScene scene;
  scene.add_rectangle({4, -2, -2}, {0, 4, 0}, {0, 0, 4});
  const auto map = map_of(scene, 0.1);
  std::vector<SurveyRay> rays;
  for (int i = 0; i < 99; ++i) rays.push_back(ray_between(Vector3d::Zero(), {4, 0.05, 0.05}));
  rays.push_back(ray_between(Vector3d::Zero(), {8, 2.05, 0.05}));  // the wall is nearer
  const auto measured = [&](int threads) {
    return measure_surface(
        *map,
        [&] { return std::make_unique<Rays>(rays); },
        0.1,
        [](const SurveyRay&) { return true; },
        Executor(threads));
  };
  EXPECT_NEAR(measured(1).right, 0.5, 1e-6);
  // free as far as it was measured to be, and through the wall
  for (int i = 0; i < 75; ++i) rays.push_back(ray_between(Vector3d::Zero(), {3, 0, 0}, false));
  for (int i = 0; i < 25; ++i) rays.push_back(ray_between(Vector3d::Zero(), {6, 0, 0}, false));
  EXPECT_NEAR(measured(1).right, 0.5 * 0.5 + 0.5 * 0.75, 1e-6);
  EXPECT_EQ(measured(1).right, measured(5).right);
  EXPECT_EQ(measured(2).rays, 200u);
}

TEST(MapSurvey, JudgesAreStretchesOfScans) {
  const auto wall = rays_at_the_wall(4000);
  const auto judges_of = [&](std::size_t scans) {
    std::vector<std::size_t> fewest(scans + 1);
    const ScanOpener open = [&](const auto& accepts) {
      std::vector<std::size_t> taken;
      for (std::size_t i = 0; i < scans; ++i) {
        if (accepts(i)) taken.push_back(i);
      }
      if (taken.size() < fewest.size()) fewest = taken;
      return std::make_unique<Rays>(wall);
    };
    try_resolutions(open, scans, {}, Executor(2));
    return fewest;
  };
  const auto every_tenth = judges_of(25);
  EXPECT_EQ(every_tenth, (std::vector<std::size_t>{5, 15}));
  const auto stretches = judges_of(300);
  ASSERT_EQ(stretches.size(), 30u);
  EXPECT_EQ(stretches.front(), 50u);
  EXPECT_EQ(stretches[9], 59u);
  EXPECT_EQ(stretches[10], 150u);
}

}  // namespace
}  // namespace pointflight
