#include "pointflight/map/edit/map_edit.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <numeric>

#include "pointflight/core/constants.hpp"
#include "pointflight/core/math.hpp"
#include "pointflight/geometry/rotation.hpp"
#include "pointflight/map/edit/crop_region.hpp"
#include "pointflight/map/import/import_check.hpp"
#include "pointflight/map/import/map_points.hpp"
#include "pointflight/render/renderer.hpp"
#include "tests/map/edited_map.hpp"
#include "tests/support.hpp"

namespace pointflight {
namespace {

using testing::error_of;
using testing::expect_contains;
using testing::map_of;
using testing::opened;

/// A room with a pillar, a table and a ball.
ShapeScene room() {
  ShapeScene scene;
  scene.add_box({0, 0, 0}, {8, 6, 3});
  scene.add_box({2, 2, 0}, {2.6, 2.6, 3});
  scene.add_box({4, 3, 0}, {5.5, 4, 0.8});
  scene.shapes.emplace_back(SceneSphere{{6, 1.5, 1.2}, 0.5});
  return scene;
}

/// What a surfel is in the world, to the last bit of its word but for where its leaf begins.
struct WorldSurfel {
  Vector3d center;
  SurfelWord rest;
  float intensity;
};

std::vector<WorldSurfel> surfels_of(const SurfelMap& map) {
  std::vector<WorldSurfel> all;
  map.for_each_surfel([&](const Vector3d& p, const Vector3d&, double, std::uint32_t word) {
    all.push_back({p, map.words()[word] >> 30, map.intensity(word)});
  });
  const auto place = [](const WorldSurfel& s) {
    return std::array{std::llround(1e5 * s.center.x()),
                      std::llround(1e5 * s.center.y()),
                      std::llround(1e5 * s.center.z())};
  };
  std::sort(all.begin(), all.end(), [&](const WorldSurfel& a, const WorldSurfel& b) {
    return place(a) < place(b);
  });
  return all;
}

void expect_same(const std::vector<WorldSurfel>& a, const std::vector<WorldSurfel>& b) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    ASSERT_LT((a[i].center - b[i].center).norm(), 1e-9);
    ASSERT_EQ(a[i].rest, b[i].rest);
    ASSERT_EQ(a[i].intensity, b[i].intensity);
  }
}

/// Beams all around from one place.
std::vector<Ray> rays_from(const Vector3d& origin, const Quaterniond& turn = {1, 0, 0, 0}) {
  std::vector<Ray> rays;
  for (int el = -80; el <= 80; el += 2) {
    for (int az = 0; az < 360; az += 2) {
      const auto e = math::sincos(el * kDegree);
      const auto a = math::sincos(az * kDegree);
      const Vector3d d(e.cos * a.cos, e.cos * a.sin, e.sin);
      rays.push_back({origin, (turn * d).cast<float>(), 50.0f});
    }
  }
  return rays;
}

std::vector<float> ranges(const std::shared_ptr<const SurfelMap>& map,
                          const std::vector<Ray>& rays) {
  const auto renderer = make_renderer("beam", {map});
  std::vector<float> result;
  for (const Ray& ray : rays) result.push_back(renderer->trace(ray).range);
  return result;
}

TEST(CropMap, KeepsSurfelsToTheBitAndWhatBeamsMeetOnThem) {
  const auto map = map_of(room(), 0.07);
  const Aabb box{{1.0, 0.5, -0.2}, {8.5, 5.0, 2.4}};
  const Executor executor(2);
  const auto inside = [&](const Vector3d& p) {
    return (p.array() >= box.min.array()).all() && (p.array() <= box.max.array()).all();
  };
  const auto cropped = opened(crop_map(*map, inside, {.note = "a box"}, executor));
  std::vector<WorldSurfel> wanted = surfels_of(*map);
  std::erase_if(wanted, [&](const WorldSurfel& s) { return !inside(s.center); });
  expect_same(surfels_of(*cropped), wanted);
  EXPECT_EQ(cropped->surfel_count(), wanted.size());
  EXPECT_EQ(cropped->model().tau, map->model().tau);
  const auto metadata = nlohmann::json::parse(cropped->metadata());
  EXPECT_EQ(metadata["edited"][0], "a box");
  // half a metre inside the box nothing is different
  const auto rays = rays_from({4.5, 2.0, 1.1});
  const auto before = ranges(map, rays);
  const auto after = ranges(cropped, rays);
  std::size_t compared = 0;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const Vector3d p = rays[i].origin_world +
                       rays[i].direction_world.cast<double>() * static_cast<double>(before[i]);
    const bool deep = ((p - box.min).array() > 0.5).all() && ((box.max - p).array() > 0.5).all();
    if (before[i] < 0.0f || !deep) continue;
    EXPECT_NEAR(before[i], after[i], 1e-5f);
    ++compared;
  }
  EXPECT_GT(compared, 1000u);
  EXPECT_EQ(error_of([&] {
              crop_map(
                  *map, [](const Vector3d&) { return false; }, {}, executor);
            }),
            "crop: nothing is left of it");
}

TEST(TransformMap, AShiftChangesNoWord) {
  const auto map = map_of(room(), 0.1);
  const Vector3d by(1234.5, -20.25, 3.0);
  const EditedMap edited = transform_map(*map, {Quaterniond::Identity(), by}, {}, Executor(2));
  const auto moved = opened(edited);
  EXPECT_TRUE(std::equal(map->words().begin(), map->words().end(), moved->words().begin()));
  EXPECT_LT((moved->bounds_world().min - map->bounds_world().min - by).norm(), 1e-9);
  const auto before = ranges(map, rays_from({4.5, 2.0, 1.1}));
  const auto after = ranges(moved, rays_from(Vector3d(4.5, 2.0, 1.1) + by));
  for (std::size_t i = 0; i < before.size(); ++i) EXPECT_NEAR(before[i], after[i], 1e-4f);
}

TEST(TransformMap, Statistics_ATurnCostsBeamsLessThanAHundredthOfTheResolution) {
  const double r = 0.05;
  const auto map = map_of(room(), r);
  const Pose T{quaternion_from_rpy(0.03, -0.05, 0.7), {5.0, -3.0, 2.0}};
  const EditedMap edited = transform_map(*map, T, {}, Executor(2));
  EXPECT_GE(edited.surfels + 2, map->surfel_count());
  const auto moved = opened(edited);
  const Vector3d eye(4.5, 2.0, 1.1);
  const auto before = ranges(map, rays_from(eye));
  const auto after = ranges(moved, rays_from(T * eye, T.rotation));
  std::vector<double> errors;
  std::size_t lost = 0;
  for (std::size_t i = 0; i < before.size(); ++i) {
    if (before[i] < 0.0f && after[i] < 0.0f) continue;
    if ((before[i] < 0.0f) != (after[i] < 0.0f)) {
      ++lost;
    } else {
      errors.push_back(std::abs(static_cast<double>(before[i] - after[i])));
    }
  }
  std::sort(errors.begin(), errors.end());
  EXPECT_LT(errors[errors.size() / 2], 0.01 * r);
  EXPECT_LT(errors[errors.size() * 95 / 100], 0.06 * r);
  EXPECT_LT(lost, errors.size() / 500);
  // and back again: the roundings add up, no more
  const auto back = opened(transform_map(*moved, T.inverse(), {}, Executor(2)));
  const auto again = surfels_of(*back);
  EXPECT_GE(again.size() + 4, map->surfel_count());
  std::size_t far = 0;
  for (const WorldSurfel& surfel : again) {
    far += map->nearest(surfel.center, 0.05 * r).has_value() ? 0 : 1;
  }
  EXPECT_LT(far, again.size() / 500);
}

TEST(TransformMap, Threads_DoesNotDependOnThreads) {
  const auto map = map_of(room(), 0.1);
  const Pose T{quaternion_from_rpy(0.0, 0.1, 0.3), {1.0, 2.0, 3.0}};
  const EditedMap one = transform_map(*map, T, {}, Executor(1));
  const EditedMap four = transform_map(*map, T, {}, Executor(4));
  EXPECT_EQ(map_bytes(one.tree, one.description), map_bytes(four.tree, four.description));
}

TEST(MergeMaps, PartsMakeTheWholeAndOverlapsCountOnce) {
  const auto map = map_of(room(), 0.07);
  const Executor executor(2);
  const auto part = [&](double from, double to) {
    return opened(crop_map(
        *map, [&](const Vector3d& p) { return p.x() >= from && p.x() < to; }, {}, executor));
  };
  // cut in two: the same surfels again
  const EditedMap halves = merge_maps({{part(-1.0, 4.0), {}}, {part(4.0, 9.0), {}}}, {}, executor);
  // those that a neighbour on the other side covers are counted as its
  EXPECT_EQ(halves.surfels + halves.doubles, map->surfel_count());
  EXPECT_LT(halves.doubles, map->surfel_count() / 50);
  // a third of the room in both
  const EditedMap overlapping =
      merge_maps({{part(-1.0, 5.0), {}}, {part(3.0, 9.0), {}}}, {}, executor);
  EXPECT_LT(overlapping.surfels, map->surfel_count() + map->surfel_count() / 100);
  EXPECT_GT(overlapping.surfels, map->surfel_count() - map->surfel_count() / 50);
  const auto rays = rays_from({4.5, 2.0, 1.1});
  const auto before = ranges(map, rays);
  const auto after = ranges(opened(overlapping), rays);
  std::size_t off = 0;
  for (std::size_t i = 0; i < rays.size(); ++i) off += std::abs(before[i] - after[i]) > 0.05f;
  EXPECT_LT(off, rays.size() / 200);
}

TEST(MergeMaps, PosesAndWhatCannotBeJoined) {
  const auto map = map_of(room(), 0.1);
  const Pose beside{Quaterniond::Identity(), {10.0, 0.0, 0.0}};
  const Executor executor(2);
  const EditedMap both = merge_maps({{map, {}}, {map, beside}}, {}, executor);
  EXPECT_EQ(both.doubles, 0u);
  EXPECT_NEAR(both.description.bounds_world.max.x(), map->bounds_world().max.x() + 10.0, 0.01);
  EXPECT_EQ(both.surfels, 2 * map->surfel_count());
  const auto coarse = map_of(room(), 0.2);
  expect_contains(error_of([&] {
                    merge_maps({{map, {}}, {coarse, {}}}, {}, executor);
                  }),
                  "resolutions of 0.1 m and 0.2 m");
  // intensities keep their meaning if all mean the same
  MapDescription told = description_of(*map);
  set_reflectivity(told, 0.01);
  const EditedMap same = transform_map(*map, {}, {}, executor);
  const auto percent = SurfelMap::from_bytes(map_bytes(same.tree, told), "percent");
  const auto scale = [&](const std::vector<PlacedMap>& maps) {
    return opened(merge_maps(maps, {}, executor))->reflectivity_per_intensity();
  };
  EXPECT_EQ(scale({{percent, {}}, {percent, beside}}), 0.01);
  EXPECT_EQ(scale({{percent, {}}, {map, beside}}), 0.0);
  EXPECT_EQ(scale({{map, {}}, {percent, beside}}), 0.0);
  expect_contains(error_of([&] { merge_maps({}, {}, executor); }), "no maps");
  expect_contains(error_of([&] { merge_maps({{nullptr, {}}}, {}, executor); }), "null");
  const Pose wrong{Quaterniond(2.0, 0.0, 0.0, 0.0), Vector3d::Zero()};
  expect_contains(error_of([&] { transform_map(*map, wrong, {}, executor); }), "unit quaternion");
}

TEST(MapDiff, FindsWhatIsInOneOnlyAsBruteForceDoes) {
  ShapeScene with = room();
  with.add_box({1, 4, 0}, {1.5, 4.5, 1});
  const auto a = map_of(with, 0.1);
  const auto b = map_of(room(), 0.1);
  const Executor executor(2);
  std::vector<Vector3d> found;
  const std::uint64_t count =
      for_each_missing(*a, *b, 0.2, 1.0, executor, [&](const Vector3d& p, double d) {
        found.push_back(p);
        EXPECT_GT(d, 0.2);
      });
  EXPECT_EQ(count, a->surfel_count());
  std::size_t expected = 0;
  a->for_each_surfel([&](const Vector3d& p, const Vector3d&, double, std::uint32_t) {
    expected += b->nearest(p, 0.2).has_value() ? 0 : 1;
  });
  EXPECT_EQ(found.size(), expected);
  EXPECT_GT(found.size(), 100u);
  for (const Vector3d& p : found) {
    EXPECT_TRUE(p.x() > 0.8 && p.x() < 1.7 && p.y() > 3.8 && p.y() < 4.7) << p.transpose();
  }
  for_each_missing(*b, *a, 0.2, 1.0, executor, [&](const Vector3d& p, double) {
    EXPECT_TRUE(p.x() > 1.0 && p.x() < 1.5 && p.z() < 0.2) << p.transpose();  // beneath the box
  });
}

TEST(Polygon, EvenOddRule) {
  const std::vector<std::array<double, 2>> u = {
      {0, 0}, {3, 0}, {3, 3}, {2, 3}, {2, 1}, {1, 1}, {1, 3}, {0, 3}};
  EXPECT_TRUE(polygon_contains(u, 0.5, 2.0));
  EXPECT_FALSE(polygon_contains(u, 1.5, 2.0));
  EXPECT_TRUE(polygon_contains(u, 1.5, 0.5));
  EXPECT_FALSE(polygon_contains(u, 3.5, 0.5));
}

TEST(GroundHeight, FollowsASlopeUnderThingsAndStrays) {
  // a slope of 20 %, a table of 5 m, a ceiling, reflections below
  GroundHeight ground;
  const auto slope = [](double x) { return 0.2 * x; };
  for (int i = 0; i < 400; ++i) {
    for (int j = 0; j < 200; ++j) {
      const double x = 0.1 * i;
      const double y = 0.1 * j;
      const bool table = x > 10.0 && x < 15.0 && y > 5.0 && y < 10.0;
      ground.add({x, y, slope(x) + (table ? 1.0 : 0.0)});
      ground.add({x, y, slope(x) + 4.0});
      if (i % 40 == 0 && j % 40 == 0) ground.add({x, y, slope(x) - 3.0});
    }
  }
  ground.finish();
  for (const auto& [x, y] : {std::pair(3.0, 3.0), std::pair(12.5, 7.5), std::pair(30.0, 15.0)}) {
    EXPECT_NEAR(ground.at(x, y), slope(x), 0.25) << x;
  }
  EXPECT_NEAR(ground.at(45.0, 10.0), slope(40.0), 1.0);  // beside it
  EXPECT_NE(error_of([] { GroundHeight().finish(); }), "");
  EXPECT_NE(error_of([] { GroundHeight(0.0); }), "");
}

TEST(CropRegion, CutsTheCeilingOfARoom) {
  const auto map = map_of(room(), 0.1);
  auto ground = std::make_shared<GroundHeight>();
  map->for_each_surfel(
      [&](const Vector3d& p, const Vector3d&, double, std::uint32_t) { ground->add(p); });
  ground->finish();
  CropRegion region;
  region.above_ground_max = 2.8;
  region.ground = ground;
  const auto low = opened(crop_map(
      *map, [&](const Vector3d& p) { return region.contains(p); }, {}, Executor(2)));
  EXPECT_LT(low->bounds_world().max.z(), 2.95);
  std::size_t floor_before = 0;
  std::size_t floor_after = 0;
  const auto count = [](const SurfelMap& m, std::size_t& n) {
    m.for_each_surfel([&](const Vector3d& p, const Vector3d&, double, std::uint32_t) {
      n += p.z() < 0.1 ? 1 : 0;
    });
  };
  count(*map, floor_before);
  count(*low, floor_after);
  EXPECT_EQ(floor_before, floor_after);
}

TEST(FloorPlane, TheTiltOfARoomAndWhatLevelsIt) {
  const auto map = map_of(room(), 0.08);
  for (const double degrees : {0.0, 0.4, 3.0, 12.0}) {
    SCOPED_TRACE(degrees);
    const Pose tilted{quaternion_from_rpy(degrees * kDegree, 0.0, 0.3), {100.0, 5.0, 3.0}};
    const auto floor = find_floor(*map, tilted);
    ASSERT_TRUE(floor);
    EXPECT_NEAR(floor->tilt / kDegree, degrees, 0.1);
    const Vector3d up = floor->levelling().rotation * (tilted.rotation * Vector3d::UnitZ());
    EXPECT_GT(up.z(), 0.99999);
    EXPECT_EQ(floor_warning(*floor).empty(), degrees < 1.0);
    EXPECT_TRUE(degrees < 1.0 || floor->walls == FloorPlane::Walls::kOnTheFloor);
  }
}

TEST(FloorPlane, ARampBetweenUprightWallsIsNoTiltedMap) {
  ShapeScene ramp;
  ramp.add_rectangle({0, 0, 0}, {20, 0, 2.0}, {0, 6, 0});
  ramp.add_rectangle({0, 0, -1}, {0, 6, 0}, {0, 0, 6});
  ramp.add_rectangle({20, 0, -1}, {0, 6, 0}, {0, 0, 6});
  ramp.add_rectangle({0, 0, -1}, {20, 0, 0}, {0, 0, 6});
  const auto floor = find_floor(*map_of(ramp, 0.1));
  ASSERT_TRUE(floor);
  EXPECT_NEAR(floor->tilt / kDegree, 5.71, 0.1);
  EXPECT_EQ(floor->walls, FloorPlane::Walls::kInTheWorld);
  EXPECT_EQ(floor_warning(*floor), "");
  ShapeScene wall;
  wall.add_rectangle({0, 0, 0}, {0, 6, 0}, {0, 0, 6});
  EXPECT_FALSE(find_floor(*map_of(wall, 0.1)));
}

TEST(MapPoints, RowsLieOnTheSurfaceAsDenselyAsAsked) {
  ShapeScene plane;
  plane.add_rectangle({0, 0, 1}, {4, 0, 0}, {0, 4, 0});
  const auto map = map_of(plane, 0.1);
  std::size_t count = 0;
  for_each_row(*map, 0.0, [&](std::span<const CloudRow> rows) { count += rows.size(); });
  EXPECT_EQ(count, map->surfel_count());
  count = 0;
  for_each_row(*map, 500.0, [&](std::span<const CloudRow> rows) {
    count += rows.size();
    for (const CloudRow& row : rows) {
      EXPECT_NEAR(row.point.position.z(), 1.0, 0.005);
      EXPECT_GT(std::abs(row.normal.z()), 0.99f);
    }
  });
  // as many cells as fit, those at the border are cut
  EXPECT_NEAR(
      static_cast<double>(count), 500.0 * 0.01 * static_cast<double>(map->surfel_count()), 1.0);
  EXPECT_NE(error_of([&] { for_each_row(*map, -1.0, [](std::span<const CloudRow>) {}); }), "");
}

}  // namespace
}  // namespace pointflight
