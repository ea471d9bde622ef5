// Furniture, plants and the rest that worlds are made of: closed where they are solid, and as large
// as they should be.
#include <gtest/gtest.h>

#include <cmath>

#include "pointflight/core/random.hpp"
#include "pointflight/scenes/parts/building.hpp"
#include "pointflight/scenes/parts/furniture.hpp"
#include "pointflight/scenes/parts/plants.hpp"
#include "pointflight/scenes/parts/site.hpp"
#include "pointflight/scenes/parts/traffic.hpp"

namespace pointflight {
namespace {

using Part = std::function<void(SceneBuilder&)>;

ExactScene made_of(const Part& part) {
  SceneBuilder builder(1);
  part(builder);
  return builder.finish({});
}

Aabb bounds_of_scene(const ExactScene& scene) {
  Aabb all;
  for (const Shape& shape : scene.geometry.shapes) {
    const Aabb box = bounds(shape);
    all.add(box.min);
    all.add(box.max);
  }
  return all;
}

/// How often a line through a shape crosses it.
int crossings(const Shape& shape, const Vector3d& from, const Vector3d& direction) {
  int count = 0;
  double at = 1e-9;
  while (const auto t = intersect(shape, from, direction, at)) {
    ++count;
    at = *t + 1e-7;
  }
  return count;
}

/// A line from outside enters as often as it leaves.
void expect_watertight(const std::string& name, const Part& part) {
  const ExactScene scene = made_of(part);
  const Aabb box = bounds_of_scene(scene);
  const RandomStream random(1, StreamId::kTest, 77);
  int odd = 0;
  int hits = 0;
  for (std::uint64_t i = 0; i < 400; ++i) {
    Vector3d through;
    Vector3d direction;
    for (int axis = 0; axis < 3; ++axis) {
      const auto draw = 6 * i + static_cast<std::uint64_t>(axis);
      through[axis] = box.min[axis] + random.uniform(draw) * box.size()[axis];
      direction[axis] = random.normal(draw + 3);
    }
    direction.normalize();
    const Vector3d from = through - 100.0 * direction;
    int count = 0;
    for (const Shape& shape : scene.geometry.shapes) count += crossings(shape, from, direction);
    hits += count > 0 ? 1 : 0;
    odd += count % 2;
  }
  EXPECT_EQ(odd, 0) << name;
  EXPECT_GT(hits, 20) << name;
}

void expect_size(const std::string& name,
                 const Part& part,
                 const Vector3d& size,
                 double room = 0.12) {
  const Aabb box = bounds_of_scene(made_of(part));
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_NEAR(box.size()[axis], size[axis], room) << name << " axis " << axis;
  }
}

TEST(WorldParts, SolidsAreClosed) {
  using namespace parts;
  expect_watertight("table", [](SceneBuilder& to) { add_table(to, 1.6, 0.8); });
  expect_watertight("desk", [](SceneBuilder& to) { add_desk(to); });
  expect_watertight("chair", add_chair);
  expect_watertight("monitor", [](SceneBuilder& to) { add_monitor(to); });
  expect_watertight("shelf", [](SceneBuilder& to) { add_shelf(to, 2.0, 0.4, 1.9, 5); });
  expect_watertight("cabinet", [](SceneBuilder& to) { add_cabinet(to, 1.5, 0.45, 1.6); });
  expect_watertight("sofa", [](SceneBuilder& to) { add_sofa(to); });
  expect_watertight("bed", [](SceneBuilder& to) { add_bed(to); });
  expect_watertight("column", [](SceneBuilder& to) { add_column(to, 0.4, 5.0); });
  expect_watertight("arch", [](SceneBuilder& to) { add_arch(to, 2.0, 3.0, 6.0, 0.7); });
  expect_watertight("stairs", [](SceneBuilder& to) { add_stairs(to, 1.2, 3.0); });
  expect_watertight("pipe", [](SceneBuilder& to) {
    add_pipe(to, {{0, 0, 0}, {2, 0, 0}, {2, 2, 0}}, 0.1);
  });
  expect_watertight("wall", [](SceneBuilder& to) {
    add_wall(to, {{0, 0}, {5, 2}, 0.0, 3.0, 0.2, {{1.0, 2.0, 0.0, 2.1}, {3.0, 4.0, 0.9, 2.0}}});
  });
  expect_watertight("rock", [](SceneBuilder& to) { add_rock(to, 0.5); });
  expect_watertight("pallet", [](SceneBuilder& to) { add_pallet(to, 1.2); });
  expect_watertight("person", [](SceneBuilder& to) { add_person(to); });
  expect_watertight("truck", add_truck);
  expect_watertight("forklift", [](SceneBuilder& to) { add_forklift(to); });
  for (const CarBody body : {CarBody::kSedan, CarBody::kHatchback, CarBody::kVan}) {
    expect_watertight("car", [&](SceneBuilder& to) { add_car(to, body); });
  }
}

TEST(WorldParts, HaveTheSizesOfWhatTheyAre) {
  using namespace parts;
  expect_size("table", [](SceneBuilder& to) { add_table(to, 1.6, 0.8); }, {0.8, 1.6, 0.74});
  expect_size("chair", add_chair, {0.46, 0.46, 0.9});
  expect_size("sedan", [](SceneBuilder& to) { add_car(to, CarBody::kSedan); }, {4.4, 2.0, 1.42});
  expect_size("van", [](SceneBuilder& to) { add_car(to, CarBody::kVan); }, {4.9, 2.04, 1.95});
  expect_size(
      "person", [](SceneBuilder& to) { add_person(to); }, {0.3, 0.6, 1.75}, 0.15);
  expect_size("forklift", [](SceneBuilder& to) { add_forklift(to); }, {3.2, 1.2, 2.4});
  expect_size("stairs", [](SceneBuilder& to) { add_stairs(to, 1.2, 3.0); }, {0.28 * 17, 1.2, 3.0});
  expect_size("scaffold", [](SceneBuilder& to) { add_scaffold(to, 4, 3); }, {1.05, 10.05, 7.0});
  Tree tree;
  expect_size(
      "conifer", [&](SceneBuilder& to) { add_conifer(to, tree); }, {4.2, 4.2, 10.4}, 0.7);
}

TEST(WorldParts, FramesNest) {
  SceneBuilder builder(1);
  const auto outer = builder.at({10, 0, 0}, 0.5 * 3.14159265358979);
  const auto inner = builder.at({1, 0, 2});
  builder.begin("box");
  builder.disc({1, 0, 0}, {0, 0, 1}, 0.1);
  const auto& disc = std::get<Disc>(builder.scene().geometry.shapes.front());
  EXPECT_NEAR((disc.center - Vector3d(10, 2, 2)).norm(), 0.0, 1e-9);
}

}  // namespace
}  // namespace pointflight
