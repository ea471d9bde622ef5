// Small cases that show one thing each: renderer behaviour at walls, edges, thin things.
#include <functional>

#include "pointflight/scenes/exact_scene.hpp"

namespace pointflight {
namespace {

/// A wall from (x, 0, 0) in the y-z plane, `width` wide, that beams can end at.
void add_back_wall(ExactScene& scene, double x, double width, double height) {
  const std::size_t first = scene.geometry.shapes.size();
  scene.geometry.add_rectangle({x, -width / 2, 0}, {0, width, 0}, {0, 0, height});
  scene.tag_from(first, "wall");
}

void set_free(ExactScene& scene, const Vector3d& min, const Vector3d& max) {
  scene.free.add(min);
  scene.free.add(max);
}

ExactScene closed_box() {
  ExactScene scene;
  scene.geometry.add_box({0, 0, 0}, {6, 4, 3});
  scene.tag_from(0, "wall");
  set_free(scene, {0, 0, 0}, {6, 4, 3});
  return scene;
}

ExactScene partition(double thickness) {
  ExactScene scene;
  scene.geometry.add_box({-thickness / 2, -3, 0}, {thickness / 2, 3, 3});
  scene.tag_from(0, "partition", 1.0f, true);
  set_free(scene, {-4, -3, 0.3}, {4, 3, 2.7});
  return scene;
}

ExactScene wire_and_pole() {
  ExactScene scene;
  const auto add = [&](double y, double radius, const std::string& tag) {
    const std::size_t first = scene.geometry.shapes.size();
    scene.geometry.shapes.emplace_back(Cone{{0, y, 0}, {0, y, 3}, radius, radius});
    scene.tag_from(first, tag, 1.0f, true);
  };
  for (int i = 0; i < 3; ++i) {
    add(-2.0 + 2.0 * i, 0.0015, "wire 3 mm");
    add(-1.5 + 2.0 * i, 0.005, "pole 1 cm");
    add(-1.0 + 2.0 * i, 0.025, "pole 5 cm");
  }
  add_back_wall(scene, 3.0, 12.0, 4.0);
  set_free(scene, {-4, -3, 0.3}, {-1, 3, 2.7});
  return scene;
}

ExactScene net() {
  constexpr double kApart = 0.05;
  constexpr double kRadius = 0.00125;
  ExactScene scene;
  for (int i = 0; i <= 40; ++i) {
    const double at = i * kApart;
    scene.geometry.shapes.emplace_back(Cone{{0, at - 1, 0}, {0, at - 1, 2}, kRadius, kRadius});
    scene.geometry.shapes.emplace_back(Cone{{0, -1, at}, {0, 1, at}, kRadius, kRadius});
  }
  scene.tag_from(0, "string", 1.0f, true);
  add_back_wall(scene, 3.0, 12.0, 4.0);
  set_free(scene, {-4, -1, 0.3}, {-1, 1, 1.7});
  return scene;
}

ExactScene door_jamb() {
  ExactScene scene;
  const Vector3d up(0, 0, 3);
  for (const double side : {-1.0, 1.0}) {
    scene.geometry.add_rectangle({-0.1, side * 0.5, 0}, {0, side * 2.5, 0}, up);
    scene.geometry.add_rectangle({0.1, side * 0.45, 0}, {0, side * 2.55, 0}, up);
  }
  scene.tag_from(0, "door wall");
  // the outermost 5 cm beside the opening and its reveals: the beams go there
  const std::size_t edges = scene.geometry.shapes.size();
  for (const double side : {-1.0, 1.0}) {
    scene.geometry.add_rectangle({-0.1, side * 0.45, 0}, {0, side * 0.05, 0}, up);
    scene.geometry.add_rectangle({-0.1, side * 0.45, 0}, {0.2, 0, 0}, up);
  }
  scene.tag_from(edges, "jamb", 1.0f, true);
  add_back_wall(scene, 3.0, 12.0, 4.0);
  set_free(scene, {-4, -2, 0.3}, {-1, 2, 2.7});
  return scene;
}

ExactScene stairs() {
  constexpr double kTread = 0.28;
  constexpr double kRise = 0.17;
  ExactScene scene;
  for (int i = 0; i < 12; ++i) {
    const double x = i * kTread;
    const double z = i * kRise;
    scene.geometry.add_rectangle({x, -1, z}, {0, 2, 0}, {0, 0, kRise});
    scene.geometry.add_rectangle({x, -1, z + kRise}, {kTread, 0, 0}, {0, 2, 0});
  }
  scene.tag_from(0, "step", 1.0f, true);
  set_free(scene, {-3, -1, 0.5}, {0, 1, 3.5});
  return scene;
}

ExactScene grazing_floor() {
  ExactScene scene;
  scene.geometry.add_rectangle({0, -5, 0}, {40, 0, 0}, {0, 10, 0});
  scene.tag_from(0, "floor", 1.0f, true);
  set_free(scene, {1, -4, 0.4}, {8, 4, 1.2});
  return scene;
}

ExactScene thinning_wall() {
  ExactScene scene;
  double y = 0.0;
  // points per cell if the rest of a cloud would have 8
  for (const char* points : {"16", "8", "4", "2.5", "1.3", "0.6", "0.2"}) {
    const std::size_t first = scene.geometry.shapes.size();
    scene.geometry.add_rectangle({0, y, 0}, {0, 4, 0}, {0, 0, 3});
    scene.tag_from(first, std::string(points) + " points per cell", std::stof(points) / 8.0f, true);
    y += 4.0;
  }
  set_free(scene, {-5, 2, 0.5}, {-2, y - 2, 2.5});
  return scene;
}

ExactScene corridor() {
  ExactScene scene;
  scene.geometry.add_box({0, 0, 0}, {60, 2, 2.5});
  scene.tag_from(0, "wall", 1.0f, true);
  set_free(scene, {0, 0, 0}, {60, 2, 2.5});
  return scene;
}

struct SmallScene {
  const char* name;
  const char* about;
  std::function<ExactScene()> make;
};

const std::vector<SmallScene>& small_scenes() {
  static const std::vector<SmallScene> scenes = {
      {"box", "6 x 4 x 3 m, closed: no beam may get out", closed_box},
      {"partition_5cm", "5 cm thick, seen from both sides", [] { return partition(0.05); }},
      {"partition_2cm", "2 cm thick, seen from both sides", [] { return partition(0.02); }},
      {"wire_pole", "wires of 3 mm, poles of 1 and 5 cm before a wall", wire_and_pole},
      {"net", "strings of 2.5 mm, 5 cm apart, before a wall", net},
      {"door_jamb", "edges of an opening 0.9 m wide", door_jamb},
      {"stairs", "treads of 28 cm, rises of 17 cm", stairs},
      {"grazing_floor", "a floor seen from 0.4 to 1.2 m above it, to 39 m", grazing_floor},
      {"thinning_wall", "a wall of 16 to 0.2 points per cell", thinning_wall},
      {"corridor", "60 x 2 x 2.5 m: most beams nearly along its walls", corridor}};
  return scenes;
}

}  // namespace

std::optional<ExactScene> make_small_scene(const std::string& name) {
  for (const SmallScene& small : small_scenes()) {
    if (name != small.name) continue;
    ExactScene scene = small.make();
    scene.name = small.name;
    scene.about = small.about;
    return scene;
  }
  return std::nullopt;
}

std::vector<std::pair<std::string, std::string>> small_scene_names() {
  std::vector<std::pair<std::string, std::string>> names;
  for (const SmallScene& small : small_scenes()) names.emplace_back(small.name, small.about);
  return names;
}

}  // namespace pointflight
