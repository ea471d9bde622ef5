// Surveys of exact scenes: the walk, what the sensor reports, how maps of them are judged.
#include "pointflight/fidelity/survey.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <set>

#include "pointflight/core/constants.hpp"
#include "pointflight/core/random.hpp"
#include "pointflight/fidelity/scene_renderer.hpp"
#include "pointflight/fidelity/survey_report.hpp"
#include "pointflight/io/pose_files.hpp"
#include "tests/support.hpp"

namespace pointflight {
namespace {

using testing::error_of;
using testing::expect_contains;
using testing::TemporaryFolder;

/// A room with a pillar: 12 x 8 x 3 m.
ExactScene room() {
  ExactScene scene;
  scene.name = "room";
  scene.geometry.add_box({0, 0, 0}, {12, 8, 3});
  scene.tag_from(0, "wall");
  const std::size_t first = scene.geometry.shapes.size();
  scene.geometry.shapes.emplace_back(Cone{{6, 4, 0}, {6, 4, 3}, 0.3, 0.3});
  scene.tag_from(first, "leaf");
  return scene;
}

SurveyOptions short_walk() {
  SurveyOptions options;
  options.seconds = 3.0;
  options.noise = 0.0;
  options.shake = 0.0;
  options.shake_deg = 0.0;
  return options;
}

TEST(SceneTree, GlassIsThereForPerpendicularBeamsOnly) {
  ExactScene scene;
  scene.geometry.add_rectangle({2, -5, -5}, {0, 10, 0}, {0, 0, 10});
  scene.tag_from(0, "glass");
  scene.geometry.add_rectangle({3, -9, -9}, {0, 18, 0}, {0, 0, 18});
  scene.tag_from(2, "wall");
  const SceneTree tree(scene);
  for (const double degrees : {0.0, 10.0, 14.9, 15.1, 30.0, 60.0}) {
    SCOPED_TRACE(degrees);
    const auto met = tree.intersect(Vector3d::Zero(), unit_direction(degrees * kDegree, 0.0));
    ASSERT_TRUE(met);
    const double depth = degrees < 15.0 ? 2.0 : 3.0;
    EXPECT_NEAR(met->range, depth / std::cos(degrees * kDegree), 1e-9);
  }
  EXPECT_FALSE(tree.is_free({1.8, 0, 0}, 0.3, 500)) << "nobody walks through a pane";
}

TEST(Survey, WalksFarFromEverything) {
  const ExactScene scene = room();
  const SceneTree tree(scene);
  SurveyOptions options = short_walk();
  options.seconds = 20.0;
  const auto walk = make_walk(scene, tree, options, Duration(100'000'000));
  ASSERT_EQ(walk.size(), 201u);
  double length = 0.0;
  for (std::size_t i = 0; i < walk.size(); ++i) {
    const Vector3d& p = walk[i].pose.translation;
    EXPECT_NEAR(p.z(), 1.5, 0.3 + 1e-9);
    EXPECT_TRUE(tree.is_free(p, 0.35, 500));
    if (i > 0) length += (p - walk[i - 1].pose.translation).norm();
  }
  EXPECT_NEAR(length, 20.0, 1.0) << "1 m/s but for corners cut";
  for (const Pose& place : places_near(scene, tree, walk, 6, 1)) {
    EXPECT_TRUE(tree.is_free(place.translation, 0.25, 500));
  }
}

TEST(Survey, AWalkIsAFunctionOfItsSeed) {
  const ExactScene scene = room();
  const SceneTree tree(scene);
  SurveyOptions options = short_walk();
  const auto end_of_walk = [&] {
    return make_walk(scene, tree, options, Duration(100'000'000)).back().pose.translation;
  };
  const Vector3d end = end_of_walk();
  EXPECT_EQ(end_of_walk(), end);
  options.seed = 2;
  EXPECT_NE(end_of_walk(), end);
}

TEST(Survey, WhereNobodyCanWalkIsAnErrorOfOneLine) {
  ExactScene scene;
  scene.name = "crate";
  scene.geometry.add_box({0, 0, 0}, {0.5, 0.5, 0.5});
  scene.tag_from(0, "wall");
  const SceneTree tree(scene);
  expect_contains(error_of([&] { make_walk(scene, tree, {}, Duration(100'000'000)); }),
                  "crate': no place to walk");
}

TEST(Survey, WithoutNoiseEveryReturnLiesOnAShape) {
  const ExactScene scene = room();
  const SceneTree tree(scene);
  const Executor executor(2);
  const Survey survey = make_survey(scene, tree, load_lidar("mid360"), short_walk(), executor);
  ASSERT_EQ(survey.scans.size(), 30u);
  ASSERT_EQ(survey.poses.size(), 30u);
  const auto reader = rays_of(survey);
  std::vector<SurveyRay> batch;
  std::size_t rays = 0;
  // where the last scan ends is extrapolated
  for (std::size_t scan = 0; scan < 29 && reader->read(batch); ++scan) {
    for (const SurveyRay& ray : batch) {
      const auto met = tree.intersect(ray.origin_world, ray.direction_world.cast<double>());
      ASSERT_TRUE(met);
      ASSERT_TRUE(ray.is_return);
      ASSERT_NEAR(static_cast<double>(ray.range), met->range, 1e-4 * (1.0 + met->range));
      ++rays;
    }
  }
  EXPECT_GT(rays, 500000u);
}

TEST(Survey, ShotsWithoutAReturnSayWhatIsFree) {
  ExactScene scene;
  scene.name = "ground";
  scene.geometry.add_rectangle({0, 0, 0}, {12, 0, 0}, {0, 8, 0});
  scene.tag_from(0, "ground");
  const SceneTree tree(scene);
  const Executor executor(2);
  const LidarSettings lidar = load_lidar("mid360");
  const Survey survey = make_survey(scene, tree, lidar, short_walk(), executor);
  std::size_t empty = 0;
  const auto reader = rays_of(survey);
  std::vector<SurveyRay> batch;
  while (reader->read(batch)) {
    for (const SurveyRay& ray : batch) {
      if (ray.is_return) continue;
      ++empty;
      ASSERT_NEAR(static_cast<double>(ray.range), 0.5 * lidar.range_max, 1e-3);
    }
  }
  EXPECT_GT(empty, 100000u);
}

TEST(Survey, WhatIsTooNearIsLost) {
  ExactScene scene = room();
  scene.geometry.shapes.emplace_back(Cone{{0, 0, 1.0}, {12, 8, 2.0}, 0.01, 0.01});
  scene.tag_from(scene.geometry.shapes.size() - 1, "pole");
  const SceneTree tree(scene);
  LidarSettings lidar = load_lidar("mid360");
  const Executor executor(2);
  const auto shots = [&] {
    std::size_t count = 0;
    for (const auto& scan : make_survey(scene, tree, lidar, short_walk(), executor).scans) {
      count += scan.size();
      for (const SurveyShot& shot : scan) {
        EXPECT_GE(static_cast<double>(shot.position_sensor.norm()), lidar.range_min - 1e-5);
        EXPECT_TRUE(shot.is_return) << "nothing is free in a closed room";
      }
    }
    return count;
  };
  const std::size_t all = shots();
  lidar.range_min = 2.0;
  EXPECT_LT(shots(), all * 9 / 10);
}

TEST(Survey, ItsReturnsHaveTheNoiseThatWasAskedFor) {
  const ExactScene scene = room();
  const SceneTree tree(scene);
  const Executor executor(2);
  SurveyOptions options = short_walk();
  options.seconds = 1.0;
  const Survey exact = make_survey(scene, tree, load_lidar("mid360"), options, executor);
  options.noise = 0.02;
  const Survey noisy = make_survey(scene, tree, load_lidar("mid360"), options, executor);
  double squares = 0.0;
  double count = 0.0;
  for (std::size_t scan = 0; scan < exact.scans.size(); ++scan) {
    ASSERT_EQ(exact.scans[scan].size(), noisy.scans[scan].size());
    for (std::size_t i = 0; i < exact.scans[scan].size(); ++i) {
      const Vector3f moved =
          noisy.scans[scan][i].position_sensor - exact.scans[scan][i].position_sensor;
      squares += static_cast<double>(moved.squaredNorm());
      ++count;
    }
  }
  EXPECT_NEAR(std::sqrt(squares / count), 0.02, 4 * 0.02 / std::sqrt(2 * count));
}

TEST(Survey, ThinnedCloudsKeepOnePointOfACube) {
  const ExactScene scene = room();
  const SceneTree tree(scene);
  const Executor executor(2);
  SurveyOptions options = short_walk();
  options.seconds = 1.0;
  const Survey survey = make_survey(scene, tree, load_lidar("mid360"), options, executor);
  const auto cloud = thinned(cloud_of(rays_of(survey)), 0.1);
  std::set<std::array<long, 3>> cubes;
  std::vector<CloudPoint> batch;
  std::size_t points = 0;
  while (cloud->read(batch)) {
    for (const CloudPoint& point : batch) {
      const Vector3d cube = (point.position / 0.1).array().floor();
      cubes.insert({std::lround(cube.x()), std::lround(cube.y()), std::lround(cube.z())});
      ++points;
    }
  }
  EXPECT_EQ(cubes.size(), points);
  EXPECT_GT(points, 2000u);
}

/// Whether rays from in front of a wall at x = 1 show a point on the side with this normal.
bool is_seen(const Vector3d& point, const Vector3f& normal) {
  SeenSurfaces seen;
  seen.add({{0, 0, 0}, Vector3f::UnitX(), 1.0f});
  seen.add({{0, 0.5, 0}, Vector3f::UnitX(), 1.0f, 0.0f, false});  // no return
  return seen.has(point, normal);
}

TEST(SeenSurfaces, AreSeenNearAReturnFromItsSide) {
  const Vector3f front = -Vector3f::UnitX();
  EXPECT_TRUE(is_seen({1, 0, 0}, front));
  EXPECT_TRUE(is_seen({1, 0.06, -0.07}, front));
  EXPECT_FALSE(is_seen({1, 0.08, 0.08}, front)) << "too far from it";
  EXPECT_FALSE(is_seen({1.02, 0, 0}, -front)) << "the wall's back";
  EXPECT_FALSE(is_seen({1, 0.5, 0}, front)) << "a ray without a return shows nothing";
  EXPECT_FALSE(is_seen({std::nan(""), 0, 0}, front));
  EXPECT_FALSE(is_seen({1e9, 0, 0}, front));
}

TEST(SeenSurfaces, OneReturnStandsForOthersOfItsDirectionAlone) {
  SeenSurfaces seen;
  seen.add({{0, 0, 0}, Vector3f::UnitX(), 1.0f});
  seen.add({{2, 0, 0}, -Vector3f::UnitX(), 1.0f});  // the same position from behind
  EXPECT_TRUE(seen.has({1, 0, 0}, -Vector3f::UnitX()));
  EXPECT_TRUE(seen.has({1, 0, 0}, Vector3f::UnitX()));
}

TEST(SupportedCells, AreThoseNearACellWithAPoint) {
  SupportedCells cells;
  std::vector<Vector3d> middles;  // of cells that have points
  const RandomStream random(5, StreamId::kTest, 0);
  for (std::uint64_t i = 0; i < 600; ++i) {
    const auto [x, y] = random.uniform2(2 * i);
    const Vector3d point(2.0 * x - 1.0, 2.0 * y - 1.0, random.uniform(2 * i + 1) - 0.5);
    cells.add(point);
    middles.emplace_back((point / 0.05).array().floor() * 0.05 + 0.025);
  }
  int supported = 0;
  for (std::uint64_t i = 0; i < 3000; ++i) {
    const auto [x, y] = random.uniform2(10000 + 2 * i);
    const Vector3d point(2.4 * x - 1.2, 2.4 * y - 1.2, 1.4 * random.uniform(10001 + 2 * i) - 0.7);
    const bool is_near = std::any_of(middles.begin(), middles.end(), [&](const Vector3d& middle) {
      return (middle - point).norm() <= 0.1;
    });
    ASSERT_EQ(cells.has(point), is_near) << i;
    supported += is_near ? 1 : 0;
  }
  EXPECT_GT(supported, 300);
  EXPECT_LT(supported, 2700);
  EXPECT_FALSE(cells.has({std::nan(""), 0, 0}));
  EXPECT_FALSE(cells.has({1e12, 0, 0}));
  cells.add({5e6, 4e5, 100});  // in UTM
  EXPECT_TRUE(cells.has({5e6, 4e5, 100.02}));
  EXPECT_FALSE(cells.has({5e6, 4e5 + 1.0, 100}));
}

/// The true ranges, moved.
class MovedRenderer : public SceneRenderer {
 public:
  MovedRenderer(const ExactScene& scene, const SceneTree& tree, float offset)
      : SceneRenderer(scene, tree), offset_(offset) {}

 protected:
  void render_one(const RenderJob& job, const Executor& executor) const override {
    SceneRenderer::render_one(job, executor);
    for (Hit& hit : job.hits) {
      if (hit.is_return()) hit.range += offset_;
    }
  }

 private:
  float offset_;
};

/// Beams in the room, whose west end was not surveyed.
struct HalfSurveyed {
  ExactScene scene = room();
  SceneTree tree{scene};
  Executor executor{2};
  SceneBeams beams;
  SeenSurfaces seen;
  std::size_t on_west_wall = 0;

  HalfSurveyed() {
    BeamPlan plan;
    plan.places = {{Quaterniond::Identity(), {3, 4, 1.5}}};
    plan.aimed_beams = 20000;
    beams = cast_exactly(scene, plan, executor);
    for (const TrueBeam& beam : beams.beams) {
      const SurveyRay ray{beam.ray.origin_world, beam.ray.direction_world, beam.range};
      if (ray.point_world().x() < 0.01) ++on_west_wall;
      if (ray.point_world().x() >= 0.3) seen.add(ray);
    }
  }
  [[nodiscard]] SurveyReport report(float offset) const {
    return measure_survey(scene, beams, seen, MovedRenderer(scene, tree, offset), executor);
  }
};

TEST(SurveyReport, SortsBeamsIntoClasses) {
  const HalfSurveyed half;
  const SurveyReport exact = half.report(0.0f);
  EXPECT_GE(exact.unseen.rays, half.on_west_wall) << "the wall and what lies in its corners";
  EXPECT_LT(exact.unseen.rays, 2 * half.on_west_wall);
  EXPECT_EQ(exact.all.rays, exact.inside.rays + exact.edge.rays + exact.foliage.rays);
  EXPECT_EQ(exact.all.rays + exact.unseen.rays, half.beams.beams.size());
  EXPECT_GT(exact.foliage.rays, 100u);
  EXPECT_GT(exact.edge.rays, 10u);
}

TEST(SurveyReport, SaysHowFarRangesAreOff) {
  const HalfSurveyed half;
  const SurveyReport exact = half.report(0.0f);
  EXPECT_EQ(exact.all.wrong_fraction, 0.0);
  EXPECT_LT(exact.foliage_distance, 1e-5);
  EXPECT_GT(exact.foliage_distance_beside, 0.0) << "leaves hide what lies behind them";
  const SurveyReport moved = half.report(0.25f);
  EXPECT_NEAR(moved.foliage_distance, 0.25, 1e-5);
  EXPECT_EQ(moved.inside.wrong_fraction, 1.0);
}

}  // namespace
}  // namespace pointflight
