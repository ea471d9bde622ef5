// Made-up worlds: what each kind promises, whatever the seed.
#include "pointflight/scenes/made_world.hpp"

#include <gtest/gtest.h>

#include <cstdlib>
#include <set>

#include "pointflight/core/input_error.hpp"
#include "pointflight/map/map_file.hpp"
#include "pointflight/scenes/scene_class.hpp"
#include "pointflight/scenes/scene_tree.hpp"
#include "pointflight/scenes/world_map.hpp"
#include "tests/support.hpp"

namespace pointflight {
namespace {

using testing::error_of;
using testing::expect_contains;

/// Share of positions where a sensor may stand that are 0.3 m from everything.
double free_share(const ExactScene& scene, int tries) {
  const SceneTree tree(scene);
  const RandomStream random(2, StreamId::kTest, 5);
  int free = 0;
  for (int i = 0; i < tries; ++i) {
    Vector3d p;
    for (int axis = 0; axis < 3; ++axis) {
      p[axis] = random.uniform(
          static_cast<std::uint64_t>(3 * i + axis), scene.free.min[axis], scene.free.max[axis]);
    }
    free += tree.is_free(p, 0.3, 40) ? 1 : 0;
  }
  return static_cast<double>(free) / tries;
}

void expect_sound(const WorldKind& kind, std::uint64_t seed) {
  SCOPED_TRACE(kind.name + " " + std::to_string(seed));
  const ExactScene scene = make_world({kind.name, seed, {}});
  ASSERT_EQ(scene.shape_tag.size(), scene.geometry.shapes.size());
  ASSERT_EQ(scene.shape_object.size(), scene.geometry.shapes.size());
  Aabb box;
  for (const Shape& shape : scene.geometry.shapes) {
    const Aabb own = bounds(shape);
    ASSERT_TRUE(own.min.allFinite() && own.max.allFinite());
    box.add(own.min);
    box.add(own.max);
  }
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_GT(box.size()[axis], 0.65 * kind.size[axis] - 0.5) << axis;
    EXPECT_LT(box.size()[axis], 1.3 * kind.size[axis] + 9.0) << axis;
    EXPECT_GE(scene.free.min[axis], box.min[axis]) << axis;
    EXPECT_LE(scene.free.max[axis], box.max[axis]) << axis;
  }
  std::set<std::string> known;
  for (const SceneClass& kind : scene_classes()) known.emplace(kind.name);
  for (const std::string& tag : scene.tags) EXPECT_TRUE(known.contains(tag)) << tag;
}

TEST(MadeWorlds, Slow_AreSoundWhateverTheSeed) {
  for (const WorldKind& kind : WorldKind::table().rows()) {
    for (std::uint64_t seed = 1; seed <= 3; ++seed) expect_sound(kind, seed);
  }
}

/// A hundred by `./dev deep`.
TEST(MadeWorlds, Slow_ManySeedsOfEachAreSound) {
  const std::uint64_t seeds = std::getenv("POINTFLIGHT_THOROUGH") != nullptr ? 100 : 10;
  for (const WorldKind& kind : WorldKind::table().rows()) {
    for (std::uint64_t seed = 4; seed <= seeds; ++seed) expect_sound(kind, seed);
  }
}

TEST(MadeWorlds, HaveRoomToFly) {
  for (const WorldKind& kind : WorldKind::table().rows()) {
    const double share = free_share(make_world({kind.name, 4, {}}), 300);
    // a mine and a cave are mostly rock
    EXPECT_GT(share, kind.name == "mine" || kind.name == "cave" ? 0.1 : 0.4) << kind.name;
  }
}

TEST(MadeWorlds, Slow_ASeedIsAWorld) {
  for (const WorldKind& kind : WorldKind::table().rows()) {
    const ExactScene one = make_world({kind.name, 7, {}});
    const ExactScene again = make_world({kind.name, 7, {}});
    const ExactScene other = make_world({kind.name, 8, {}});
    ASSERT_EQ(one.geometry.shapes.size(), again.geometry.shapes.size());
    bool differs = one.geometry.shapes.size() != other.geometry.shapes.size();
    for (std::size_t i = 0; i < one.geometry.shapes.size(); ++i) {
      const Aabb a = bounds(one.geometry.shapes[i]);
      const Aabb b = bounds(again.geometry.shapes[i]);
      ASSERT_EQ(a.min, b.min) << kind.name << " " << i;
      ASSERT_EQ(a.max, b.max) << kind.name << " " << i;
      if (!differs) differs = a.min != bounds(other.geometry.shapes[i]).min;
    }
    EXPECT_TRUE(differs) << kind.name;
  }
}

TEST(MadeWorlds, ParametersAreDrawnOrChosen) {
  const WorldValues drawn = values_of({"warehouse", 3, {}});
  WorldOptions chosen{"warehouse", 3, {{"aisle", 3.25}}};
  const WorldValues values = values_of(chosen);
  EXPECT_EQ(values["aisle"], 3.25);
  EXPECT_EQ(values["filled"], drawn["filled"]);
  for (const WorldKind& kind : WorldKind::table().rows()) {
    for (std::uint64_t seed = 1; seed < 50; ++seed) {
      const WorldValues all = values_of({kind.name, seed, {}});
      for (const WorldParameter& p : kind.parameters) {
        EXPECT_GE(all[p.name], p.low) << kind.name << " " << p.name;
        EXPECT_LE(all[p.name], p.high) << kind.name << " " << p.name;
      }
    }
  }
  chosen.chosen = {{"aisle", 30.0}};
  expect_contains(error_of([&] { values_of(chosen); }), "aisle is 30; 3 to 4 will do");
  chosen.chosen = {{"isle", 3.0}};
  expect_contains(error_of([&] { values_of(chosen); }), "no parameter 'isle'; one of: levels");
  expect_contains(error_of([] { values_of({"warehose", 1, {}}); }), "world 'warehose' is unknown");
}

TEST(MadeWorlds, ScenesKnowThemByName) {
  EXPECT_EQ(load_scene("indoor_1").geometry.shapes.size(),
            make_world({"indoor_1", 1, {}}).geometry.shapes.size());
  EXPECT_EQ(load_scene("indoor_1:9").geometry.shapes.size(),
            make_world({"indoor_1", 9, {}}).geometry.shapes.size());
  expect_contains(error_of([] { load_scene("indoor_1:x"); }), "indoor_1:7");
}

TEST(MadeWorlds, MapsAreTheSameBytesByAnyNumberOfThreads) {
  const WorldOptions options{"indoor_1", 5, {}};
  const ImportedMap one = make_world_map({options, 0.2}, Executor(1));
  const ImportedMap two = make_world_map({options, 0.2}, Executor(2));
  EXPECT_EQ(map_bytes(one.tree, one.description), map_bytes(two.tree, two.description));
  EXPECT_GT(one.report.surfels, 5000u);
}

}  // namespace
}  // namespace pointflight
