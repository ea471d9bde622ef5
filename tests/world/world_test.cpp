#include <gtest/gtest.h>

#include "pointflight/world/clearance.hpp"
#include "pointflight/world/contact.hpp"
#include "pointflight/world/free_space.hpp"
#include "tests/support.hpp"

namespace pointflight {
namespace {

using testing::map_of;

TEST(Contact, OfABallBeforeAWallIsTheGap) {
  ShapeScene scene;
  scene.add_rectangle({5, -3, -3}, {0, 6, 0}, {0, 0, 6});
  const auto map = map_of(scene, 0.05);
  for (const double gap : {0.05, 0.5, 2.0}) {
    const auto c = contact_with_map(
        *map, Sphere{0.3}, {Quaterniond::Identity(), {5.0 - 0.3 - gap, 0.1, 0.2}}, 10.0);
    ASSERT_TRUE(c);
    EXPECT_NEAR(c->distance, gap, 0.005);
    EXPECT_NEAR(c->position_world.x(), 5.0, 0.01);
  }
  EXPECT_LT(
      contact_with_map(*map, Sphere{0.3}, {Quaterniond::Identity(), {4.8, 0, 0}}, 10.0)->distance,
      -0.09);
  EXPECT_FALSE(contact_with_map(*map, Sphere{0.3}, {Quaterniond::Identity(), {-20, 0, 0}}, 10.0));
}

TEST(Clearance, AlongALineFindsAThinPole) {
  ShapeScene scene;
  scene.shapes.emplace_back(Cone{{5, 0.2, -1}, {5, 0.2, 1}, 0.01, 0.01});
  const auto map = map_of(scene, 0.05);
  EXPECT_LT(clearance_along(*map, {0, 0, 0}, {10, 0, 0}, 0.3, 1.0), 0.0);
  EXPECT_NEAR(clearance_along(*map, {0, -0.5, 0}, {10, -0.5, 0}, 0.3, 1.0), 0.37, 0.04);
  EXPECT_EQ(clearance_along(*map, {0, 8, 0}, {10, 8, 0}, 0.3, 1.0), 1.0);
}

TEST(FreeSpace, FindsATourInsideTheRoomAndAroundItsWall) {
  // two rooms joined by a door
  ShapeScene scene;
  scene.add_box({0, 0, 0}, {20, 10, 4});
  scene.add_rectangle({10, 0, 0}, {0, 7, 0}, {0, 0, 4});
  const auto map = map_of(scene, 0.1);
  const Executor executor(2);
  TourOptions options;
  options.length_min = 30.0;
  const auto tour = find_tour(*map, options, executor);
  ASSERT_TRUE(tour);
  EXPECT_GE(tour->length, 30.0);
  bool left = false;
  bool right = false;
  for (const Vector3d& p : tour->points_world) {
    EXPECT_TRUE((p.array() > 0.0).all() && p.x() < 20 && p.y() < 10 && p.z() < 4) << p.transpose();
    left = left || p.x() < 8;
    right = right || p.x() > 12;
  }
  EXPECT_TRUE(left && right);
  for (std::size_t i = 1; i < tour->points_world.size(); ++i) {
    EXPECT_GE(clearance_along(
                  *map, tour->points_world[i - 1], tour->points_world[i], options.radius, 1.0),
              options.margin - 0.01);
  }
  const auto again = find_tour(*map, options, Executor(1));
  ASSERT_EQ(again->points_world.size(), tour->points_world.size());
  EXPECT_EQ(again->points_world.back(), tour->points_world.back());
}

TEST(FreeSpace, Statistics_StaysInItsBounds) {
  // a hall with a mezzanine of more room above than below
  ShapeScene scene;
  scene.add_box({0, 0, 0}, {20, 10, 30});
  scene.add_rectangle({0, 0, 4}, {20, 0, 0}, {0, 10, 0});
  const auto map = map_of(scene, 0.1);
  TourOptions options;
  options.length_min = 10.0;
  options.bounds = Aabb{{2, 1, 0.5}, {18, 9, 1.6}};
  const auto tour = find_tour(*map, options, Executor(1));
  ASSERT_TRUE(tour);
  for (const Vector3d& p : tour->points_world) {
    EXPECT_GE((p - options.bounds->min).minCoeff(), 0.0) << p.transpose();
    EXPECT_GE((options.bounds->max - p).minCoeff(), 0.0) << p.transpose();
  }
  options.bounds = Aabb{{30, 0, 0}, {40, 10, 4}};
  EXPECT_FALSE(find_tour(*map, options, Executor(1)));
}

TEST(FreeSpace, SaysWhenThereIsNone) {
  ShapeScene scene;
  scene.add_box({0, 0, 0}, {0.4, 0.4, 0.4});
  EXPECT_FALSE(find_tour(*map_of(scene, 0.05), {}, Executor(1)));
}

}  // namespace
}  // namespace pointflight
