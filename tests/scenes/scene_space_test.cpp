// Free space of exact scenes, ways through it and tasks: against closed forms, brute force and
// rays.
#include "pointflight/scenes/scene_space.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <numeric>
#include <set>
#include <vector>

#include "pointflight/core/constants.hpp"
#include "pointflight/core/random.hpp"
#include "pointflight/geometry/polyline.hpp"
#include "pointflight/scenes/made_world.hpp"
#include "pointflight/scenes/scene_builder.hpp"
#include "pointflight/scenes/scene_tree.hpp"
#include "pointflight/scenes/space_ways.hpp"
#include "pointflight/scenes/world_tasks.hpp"
#include "tests/support.hpp"

namespace pointflight {
namespace {

using testing::error_of;
using testing::expect_contains;

constexpr double kDeep = 6.0;  // m, of the rooms
constexpr double kHigh = 3.0;

/// Two rooms of 5 x 6 x 3 m side by side, with a door that is `door` wide beside the wall at y = 0.
ExactScene two_rooms(double door) {
  SceneBuilder to(1);
  to.begin("wall");
  to.rectangle({0, 0, 0}, {10, 0, 0}, {0, kDeep, 0});
  to.rectangle({0, 0, kHigh}, {10, 0, 0}, {0, kDeep, 0});
  for (const double x : {0.0, 10.0}) to.rectangle({x, 0, 0}, {0, kDeep, 0}, {0, 0, kHigh});
  for (const double y : {0.0, kDeep}) to.rectangle({0, y, 0}, {10, 0, 0}, {0, 0, kHigh});
  to.rectangle({5, door, 0}, {0, kDeep - door, 0}, {0, 0, kHigh});
  Aabb free;
  free.add({0.05, 0.05, 0.05});
  free.add({9.95, kDeep - 0.05, kHigh - 0.05});
  return to.finish(free);
}

/// Distance to the nearest of the planes of `two_rooms`.
double room_at(const Vector3d& p, double door) {
  double room = std::min({p.x(), 10.0 - p.x(), p.y(), kDeep - p.y(), p.z(), kHigh - p.z()});
  const double beside = std::max(0.0, door - p.y());
  return std::min(room, std::hypot(p.x() - 5.0, beside));
}

TEST(SceneSpace, ClearanceIsTheDistanceToTheNearestSurface) {
  const SceneSpace space(two_rooms(1.2), {}, Executor(2));
  double worst = 0.0;
  for (std::size_t at = 0; at < space.count(); at += 7) {
    const Vector3d p = space.center(at);
    if (room_at(p, 1.2) < 0.0) continue;  // beyond the walls
    const double most = SceneSpace::kReach * space.cell() - 0.5 * space.cell();
    worst = std::max(worst, std::abs(space.clearance(at) - std::min(room_at(p, 1.2), most)));
  }
  EXPECT_LT(worst, 1.01 * space.cell());
}

TEST(SceneSpace, KnowsWhatIsConnected) {
  const SceneSpace open(two_rooms(1.2), {}, Executor(1));
  const SceneSpace closed(two_rooms(0.5), {}, Executor(1));
  const Vector3d left(2, 3, 1.5);
  const Vector3d right(8, 3, 1.5);
  EXPECT_TRUE(open.is_reachable(open.cell_of(left)));
  EXPECT_TRUE(open.is_reachable(open.cell_of(right)));
  EXPECT_NE(closed.is_reachable(closed.cell_of(left)), closed.is_reachable(closed.cell_of(right)));
  EXPECT_NEAR(open.height(open.cell_of(left)), 1.5, 0.11);
  // all but 0.3 m along the walls
  const double volume = (10 - 0.6) * (kDeep - 0.6) * (kHigh - 0.6) - 0.6 * (kDeep - 0.9) * 2.4;
  EXPECT_NEAR(open.reachable_volume(), volume, 0.08 * volume);
  EXPECT_NEAR(closed.reachable_volume(), 0.5 * volume, 0.08 * volume);
  EXPECT_NEAR(open.flyable_share(), (9.4 * 5.4 - 0.6 * 5.1) / (9.9 * 5.9), 0.04);
  SpaceOptions wide;
  wide.radius = 1.6;
  expect_contains(error_of([&] { SceneSpace(two_rooms(1.2), wide, Executor(1)); }), "1.6 m fits");
}

TEST(SceneSpace, ThreadsDoNotMatter) {
  const ExactScene scene = make_world({"indoor_1", 4, {}});
  const SceneSpace one(scene, {}, Executor(1));
  const SceneSpace two(scene, {}, Executor(2));
  ASSERT_EQ(one.count(), two.count());
  for (std::size_t at = 0; at < one.count(); ++at) {
    ASSERT_EQ(one.clearance(at), two.clearance(at));
    ASSERT_EQ(one.is_reachable(at), two.is_reachable(at));
  }
}

TEST(SpaceWays, ShortestAndWidestAreThoseOfTheDoor) {
  const double door = 1.4;
  const SceneSpace space(two_rooms(door), {}, Executor(1));
  const SpaceWays ways(space);
  const Vector3d from(4.0, 5.0, 1.5);
  const Vector3d to(6.0, 5.0, 1.5);
  const std::uint32_t start = ways.number_at(from);
  const std::uint32_t goal = ways.number_at(to);
  const auto way = straightened(space, ways.way_back(ways.shortest_from(start), goal));
  // around the edge of the wall by the radius: two tangents and an arc
  const double radius = space.options().radius;
  const double away = std::hypot(1.0, 5.0 - door);
  const double turn = kPi - 2.0 * (std::atan2(1.0, 5.0 - door) - std::asin(radius / away));
  const double shortest = 2.0 * std::sqrt(away * away - radius * radius) + radius * turn;
  EXPECT_GT(length_of(way), shortest);
  EXPECT_LT(length_of(way), 1.07 * shortest);
  EXPECT_NEAR(static_cast<double>(ways.widest_from(start)[goal]), 0.5 * door, space.cell());
  // not reached within a metre
  EXPECT_EQ(ways.shortest_from(start, 10 * SpaceWays::kStep)[goal], SpaceWays::kUnreached);
  const SceneSpace closed(two_rooms(0.4), {}, Executor(1));
  EXPECT_EQ(SpaceWays(closed).number_at(closed.is_reachable(closed.cell_of(from)) ? to : from),
            SpaceWays::kUnreached);
}

/// Room around a way, by rays into the exact scene.
void expect_free(const ExactScene& scene, const SceneTree& tree, const WorldTask& task) {
  for (std::size_t i = 1; i < task.way.size(); ++i) {
    const Vector3d leg = task.way[i] - task.way[i - 1];
    for (double at = 0.0; at < leg.norm(); at += 0.2) {
      const Vector3d p = task.way[i - 1] + at * leg.normalized();
      EXPECT_TRUE(tree.is_free(p, 0.26, 100)) << scene.name << " " << p.transpose();
    }
  }
}

TEST(WorldTasks, Slow_CanBeFlown) {
  for (const char* name : {"indoor_1", "simple_garage"}) {
    SCOPED_TRACE(name);
    const ExactScene scene = make_world({name, 2, {}});
    const SceneTree tree(scene);
    const SceneSpace space(scene, {}, Executor(2));
    const auto tasks = make_tasks(space, 2, 2);
    ASSERT_EQ(tasks.size(), 6u);
    std::set<Difficulty> difficulties;
    for (const WorldTask& task : tasks) {
      difficulties.insert(task.difficulty);
      EXPECT_EQ(task.way.front(), task.start);
      EXPECT_EQ(task.way.back(), task.goal);
      EXPECT_GE(task.length, task.straight - 1e-9);
      EXPECT_GE(task.passage, 2.0 * space.options().radius - 2.0 * space.cell());
      EXPECT_GE(space.clearance(space.cell_of(task.start)), WorldTask::kRoomAtEnds);
      EXPECT_GE(space.clearance(space.cell_of(task.goal)), WorldTask::kRoomAtEnds);
      expect_free(scene, tree, task);
    }
    EXPECT_EQ(difficulties.size(), 3u);
    const auto again = make_tasks(space, 2, 2);
    for (std::size_t i = 0; i < tasks.size(); ++i) EXPECT_EQ(tasks[i].goal, again[i].goal);
    EXPECT_NE(make_tasks(space, 3, 2).front().start, tasks.front().start);
  }
}

/// Three fifths of the floor plan of each can be flown over: of one seed, or of a hundred
/// (`./dev deep`), which takes an hour.
TEST(SceneSpace, Slow_WorldsAreConnected) {
  const bool is_thorough = std::getenv("POINTFLIGHT_THOROUGH") != nullptr;
  const std::size_t seeds = is_thorough ? 100 : 1;
  for (const WorldKind& kind : WorldKind::table().rows()) {
    std::vector<double> shares(seeds);
    Executor().parallel_for(seeds, 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        const std::uint64_t seed = is_thorough ? i + 1 : 2;
        shares[i] = SceneSpace(make_world({kind.name, seed, {}}), {}, Executor(1)).flyable_share();
      }
    });
    const auto least = std::min_element(shares.begin(), shares.end());
    EXPECT_GT(*least, 0.6) << kind.name << ", seed " << least - shares.begin() + 1;
    if (!is_thorough) continue;
    std::sort(shares.begin(), shares.end());
    fmt::print("{:<20} least {:.3f}, median {:.3f}\n", kind.name, shares.front(), shares[50]);
    std::fflush(stdout);
  }
}

}  // namespace
}  // namespace pointflight
