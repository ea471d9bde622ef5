// Which space a survey saw: cells that rays cross, their section in a map file, edits of it.
#include "pointflight/map/known_space.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "pointflight/core/constants.hpp"
#include "pointflight/core/random.hpp"
#include "pointflight/geometry/rotation.hpp"
#include "pointflight/map/edit/map_edit.hpp"
#include "tests/map/edited_map.hpp"
#include "tests/support.hpp"

namespace pointflight {
namespace {

using testing::error_of;
using testing::expect_contains;
using testing::opened;

struct Way {
  Vector3d from;
  Vector3d direction;
  double range;
};

/// Rays that begin within the box and outside it, some along the axes.
std::vector<Way> some_ways(const Aabb& box, std::size_t count) {
  const RandomStream random(9, StreamId::kTest, 0);
  std::vector<Way> ways;
  for (std::size_t i = 0; i < count; ++i) {
    const auto [u, v] = random.uniform2(4 * i);
    const auto [w, x] = random.uniform2(4 * i + 1);
    const auto [y, z] = random.uniform2(4 * i + 2);
    const Vector3d from = box.min - Vector3d::Constant(1.0) +
                          (box.size() + Vector3d::Constant(2.0)).cwiseProduct(Vector3d(u, v, w));
    Vector3d direction(2 * x - 1, 2 * y - 1, 2 * z - 1);
    if (i % 10 < 3) direction = Vector3d::Unit(static_cast<int>(i % 3)) * (i % 2 == 0 ? 1 : -1);
    ways.push_back({from, direction.normalized(), 6.0 * random.uniform(4 * i + 3)});
  }
  return ways;
}

/// Does a ray come within `margin` of a cell? By slabs, the cell grown by it.
bool meets(const CellGrid& grid, std::uint64_t index, const Way& way, double margin) {
  const Vector3d half = Vector3d::Constant(0.5 * grid.cell + margin);
  const Vector3d from = way.from - grid.center_of(index);
  double enters = 0.0;
  double leaves = way.range + margin;
  for (int k = 0; k < 3; ++k) {
    if (std::abs(way.direction[k]) < 1e-12) {
      if (std::abs(from[k]) > half[k]) return false;
      continue;
    }
    const double a = (-half[k] - from[k]) / way.direction[k];
    const double b = (half[k] - from[k]) / way.direction[k];
    enters = std::max(enters, std::min(a, b));
    leaves = std::min(leaves, std::max(a, b));
  }
  return enters <= leaves;
}

const Aabb kBox = [] {
  Aabb box;
  box.add({-2.0, 1.0, 0.5});
  box.add({3.0, 4.0, 2.5});
  return box;
}();

TEST(KnownSpace, AreTheCellsThatRaysCross) {
  KnownSpaceBuilder builder(kBox, 0.05, 100000);
  const auto ways = some_ways(kBox, 40);
  for (const Way& way : ways) builder.cross(way.from, way.direction, way.range);
  const auto section = builder.section();
  const auto known = KnownSpace::from_section(section);
  ASSERT_TRUE(known);
  const CellGrid& grid = known->grid();
  EXPECT_EQ(grid.cell, 0.2);
  std::uint64_t count = 0;
  for (std::uint64_t i = 0; i < grid.count(); ++i) {
    const bool is_known = known->known(grid.center_of(i));
    count += is_known ? 1 : 0;
    const auto within = [&](double margin) {
      return std::any_of(
          ways.begin(), ways.end(), [&](const Way& way) { return meets(grid, i, way, margin); });
    };
    if (is_known) {
      EXPECT_TRUE(within(1e-9)) << i;
    } else {
      EXPECT_FALSE(within(-1e-6)) << i;
    }
  }
  EXPECT_GT(count, 100u);
  EXPECT_NEAR(
      known->known_share(), static_cast<double>(count) / static_cast<double>(grid.count()), 1e-12);
  EXPECT_FALSE(known->known(kBox.min - Vector3d::Constant(0.1)));
  EXPECT_FALSE(known->known(Vector3d::Constant(std::nan(""))));
}

TEST(KnownSpace, ARayIsKnownUpToTheFirstCellThatIsNot) {
  KnownSpaceBuilder builder(kBox, 0.05, 100000);
  for (const Way& way : some_ways(kBox, 700)) builder.cross(way.from, way.direction, way.range);
  const auto section = builder.section();
  const auto known = KnownSpace::from_section(section);
  int compared = 0;
  for (const Way& way : some_ways(kBox, 2000)) {
    const double along = known->known_along(way.from, way.direction, way.range);
    // by small steps
    double stepped = 0.0;
    constexpr double kStep = 1e-4;
    while (stepped < way.range && known->known(way.from + stepped * way.direction))
      stepped += kStep;
    stepped = std::min(stepped, way.range);
    // steps may pass over the corner of a cell
    EXPECT_LE(along, stepped + 1e-9);
    if (stepped > along + 2 * kStep) {
      const Vector3d corner = way.from + (along + 1e-9) * way.direction;
      EXPECT_FALSE(known->known(corner)) << along << " " << stepped;
    }
    compared += along > 0.2 && along < way.range ? 1 : 0;
  }
  EXPECT_GT(compared, 100);
  EXPECT_EQ(known->known_along(kBox.min, Vector3d::Constant(std::nan("")), 1.0), 0.0);
}

TEST(KnownSpace, TakesAByteForEachSurfelAtMost) {
  Aabb town;
  town.add({0, 0, 0});
  town.add({400, 300, 60});
  for (const std::uint64_t surfels : {0ull, 5000ull, 300000ull}) {
    const auto section = KnownSpaceBuilder(town, 0.1, surfels).section();
    EXPECT_LE(section.size(), std::max<std::uint64_t>(1024, surfels));
    EXPECT_GT(section.size(), std::max<std::uint64_t>(1024, surfels) * 8 / 10);
    ASSERT_TRUE(KnownSpace::from_section(section));
  }
  EXPECT_EQ(KnownSpace::from_section(KnownSpaceBuilder(kBox, 0.4, 100000).section())->grid().cell,
            0.8);
}

TEST(KnownSpace, BytesThatAreNoneAreRefused) {
  const auto good = KnownSpaceBuilder(kBox, 0.1, 1000).section();
  ASSERT_TRUE(KnownSpace::from_section(good));
  const auto with = [&](std::size_t at, auto value) {
    auto bytes = good;
    std::memcpy(bytes.data() + at, &value, sizeof value);
    return KnownSpace::from_section(bytes).has_value();
  };
  EXPECT_FALSE(KnownSpace::from_section(std::span(good).first(good.size() - 1)));
  EXPECT_FALSE(KnownSpace::from_section(std::span(good).first(40)));
  EXPECT_FALSE(with(0, 0.0));
  EXPECT_FALSE(with(0, std::nan("")));
  EXPECT_FALSE(with(8, std::numeric_limits<double>::infinity()));
  EXPECT_FALSE(with(32, 0.5));
  EXPECT_FALSE(with(64, std::uint32_t{0}));
  EXPECT_FALSE(with(64, std::uint32_t{0xffffffff}));
}

// ---- in a map

/// A wall at x = 3, and what rays from the origin saw of it.
std::shared_ptr<const SurfelMap> wall_and_what_is_known() {
  ShapeScene scene;
  scene.add_rectangle({3, -2, -2}, {0, 4, 0}, {0, 0, 4});
  const auto map = testing::map_of(scene, 0.1);
  Aabb box = map->bounds_world();
  box.add({-1.07, -3, -3});  // the wall amid cells
  box.add({5, 3, 3});
  KnownSpaceBuilder builder(box, 0.1, 100000);
  const RandomStream random(2, StreamId::kTest, 0);
  for (std::uint64_t i = 0; i < 20000; ++i) {
    const auto [u, v] = random.uniform2(i);
    const Vector3d to(3.0, 4 * u - 2, 4 * v - 2);
    builder.cross(Vector3d::Zero(), to.normalized(), to.norm());
  }
  EditedMap edited = transform_map(*map, {}, {}, Executor(1));
  set_section(edited.description, KnownSpace::kSection, builder.section());
  return SurfelMap::from_bytes(map_bytes(edited.tree, edited.description), "wall");
}

constexpr double kBefore = 2.0;  // x before the wall
constexpr double kBehind = 4.0;  // x behind it

TEST(KnownSpace, LiesBesideTheMap) {
  const auto map = wall_and_what_is_known();
  ASSERT_NE(map->known_space(), nullptr);
  EXPECT_TRUE(map->known_space()->known({kBefore, 0.3, 0.2}));
  EXPECT_FALSE(map->known_space()->known({kBehind, 0.3, 0.2}));
  // from before the wall it is seen through what is known, from behind it is not
  EXPECT_TRUE(map->known_space()->is_seen_through({0.5, 0, 0}, Vector3d::UnitX(), 2.5));
  EXPECT_FALSE(map->known_space()->is_seen_through({4.5, 0, 0}, -Vector3d::UnitX(), 1.5));
  EXPECT_EQ(&known_space_of(*map), map->known_space());
  ShapeScene scene;
  scene.shapes.emplace_back(SceneSphere{{0, 0, 0}, 1.0});
  const auto bare = testing::map_of(scene, 0.2);
  EXPECT_EQ(bare->known_space(), nullptr);
  expect_contains(error_of([&] { known_space_of(*bare); }), "map fit --scans");
  EditedMap edited = transform_map(*map, {}, {}, Executor(1));
  set_section(edited.description, KnownSpace::kSection, std::vector<std::byte>(100));
  expect_contains(error_of([&] { opened(edited); }), "known_space");
}

TEST(KnownSpace, MovesWithItsMap) {
  const auto map = wall_and_what_is_known();
  const Pose shift{Quaterniond::Identity(), {10, -20, 3}};
  const Pose turn{quaternion_from_rpy(0.2, -0.1, 2.0), {1, 2, 3}};
  for (const Pose& pose : {shift, turn}) {
    const auto moved = opened(transform_map(*map, pose, {}, Executor(1)));
    ASSERT_NE(moved->known_space(), nullptr);
    for (const Way& way : some_ways(map->bounds_world(), 300)) {
      EXPECT_EQ(moved->known_space()->known(pose * way.from), map->known_space()->known(way.from));
      EXPECT_NEAR(moved->known_space()->known_along(
                      pose * way.from, pose.rotation * way.direction, way.range),
                  map->known_space()->known_along(way.from, way.direction, way.range),
                  1e-6);
    }
  }
}

TEST(KnownSpace, IsNotKnownWhereSurfelsWereCutAway) {
  const auto map = wall_and_what_is_known();
  const auto low = opened(crop_map(
      *map, [](const Vector3d& p) { return p.z() < 0.0; }, {}, Executor(1)));
  ASSERT_NE(low->known_space(), nullptr);
  EXPECT_TRUE(low->known_space()->known({kBefore, 0.3, 1.0}));
  const Vector3d up = Vector3d(3, 0, 1).normalized();
  EXPECT_LT(low->known_space()->known_along(Vector3d::Zero(), up, 5.0), 3.2);
  EXPECT_LT(map->known_space()->known_along(Vector3d::Zero(), up, 5.0), 3.5) << "behind the wall";
  EXPECT_TRUE(map->known_space()->known({3.0, 0.05, 1.0}));
  EXPECT_FALSE(low->known_space()->known({3.0, 0.05, 1.0}));
}

TEST(KnownSpace, OfMergedMapsIsWhatOneOfThemKnows) {
  const auto map = wall_and_what_is_known();
  const Pose beside{quaternion_from_rpy(0, 0, kPi), {3.0, 8.0, 0}};
  const auto both = opened(merge_maps({{map, {}}, {map, beside}}, {}, Executor(1)));
  ASSERT_NE(both->known_space(), nullptr);
  const KnownSpace& known = *both->known_space();
  EXPECT_TRUE(known.known({kBefore, 0.3, 0.2}));
  EXPECT_FALSE(known.known({kBehind, 0.3, 0.2}));
  EXPECT_TRUE(known.known(beside * Vector3d(kBefore, 0.3, 0.2)));
  EXPECT_FALSE(known.known(beside * Vector3d(kBehind, 0.3, 0.2)));
  ShapeScene scene;
  scene.add_rectangle({3, 10, -2}, {0, 4, 0}, {0, 0, 4});
  const auto bare = testing::map_of(scene, 0.1);
  EXPECT_EQ(opened(merge_maps({{map, {}}, {bare, {}}}, {}, Executor(1)))->known_space(), nullptr);
}

}  // namespace
}  // namespace pointflight
