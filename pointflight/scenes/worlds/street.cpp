#include "pointflight/core/constants.hpp"
#include "pointflight/scenes/parts/building.hpp"
#include "pointflight/scenes/parts/furniture.hpp"
#include "pointflight/scenes/parts/plants.hpp"
#include "pointflight/scenes/parts/site.hpp"
#include "pointflight/scenes/parts/traffic.hpp"
#include "pointflight/scenes/worlds/rooms.hpp"
#include "pointflight/scenes/worlds/worlds.hpp"

namespace pointflight::worlds {
namespace {

constexpr double kStreetLong = 70.0;  // m

/// A front along x with floors of windows, a cornice, a door and a roof behind it.
void add_house_front(SceneBuilder& to, double width, int floors, double depth) {
  constexpr double kFloor = 3.2;  // m
  const double top = kFloor * floors + 0.6;
  for (int floor = 0; floor < floors; ++floor) {
    std::vector<parts::Opening> windows;
    const double z = kFloor * floor;
    const bool is_shop = floor == 0;
    if (is_shop) {
      windows.push_back({0.8, 1.9, 0.0, 2.5});
      windows.push_back({2.6, width - 0.8, 0.6, 2.6, true, 1.6});
    } else {
      const int count = static_cast<int>(width / 2.2);
      for (int i = 0; i < count; ++i) {
        const double x = width * (i + 0.5) / count;
        windows.push_back({x - 0.55, x + 0.55, 0.9, 2.5, true, 0.55});
      }
    }
    const double high = floor + 1 == floors ? top : z + kFloor;
    parts::add_wall(to, {{0, 0}, {width, 0}, z, high, 0.4, windows});
    // what is seen through the windows
    to.begin("wall");
    to.box({0.2, 2.5, z}, {width - 0.2, 2.6, z + kFloor});
    to.begin("floor");
    to.box({0.2, 0.2, z - 0.1}, {width - 0.2, 2.5, z});
    if (!is_shop) {
      to.begin("wall");
      to.box({0.0, -0.3, z - 0.08}, {width, -0.2, z + 0.08});
    }
  }
  to.begin("wall");
  to.box({-0.02, -0.45, top - 0.3}, {width + 0.02, 0.2, top});
  for (const double x : {0.1, width - 0.1}) to.rectangle({x, 0, 0}, {0, depth, 0}, {0, 0, top});
  to.rectangle({0, depth, 0}, {width, 0, 0}, {0, 0, top});
  to.begin("roof");
  to.rectangle({0, -0.2, top}, {width, 0, 0}, {0, 0.5 * depth, 2.8});
  to.rectangle({0, depth + 0.2, top}, {width, 0, 0}, {0, -0.5 * depth, 2.8});
  to.begin("door");
  to.box({0.8, 0.1, 0.0}, {1.9, 0.16, 2.5});
}

Aabb build_street(SceneBuilder& to, const WorldValues& values) {
  const double road = values["road"];
  const double walk = 3.0;
  const double y1 = road + walk;  // the far front
  to.begin("road");
  to.rectangle({0, 0, 0}, {kStreetLong, 0, 0}, {0, road, 0});
  to.begin("sidewalk");
  to.box({0, -walk, -0.2}, {kStreetLong, 0, 0.14});
  to.box({0, road, -0.2}, {kStreetLong, y1, 0.14});
  for (const bool is_far : {false, true}) {
    double x = 0.0;
    while (x < kStreetLong - 6.0) {
      double width = to.between(8.0, 15.0);
      if (kStreetLong - x - width < 7.0) width = kStreetLong - x;
      const int floors = to.whole(2, values.count("floors"));
      const auto placed = is_far ? to.at({x, y1, 0.14}) : to.at({x + width, -walk, 0.14}, kPi);
      add_house_front(to, width, floors, 9.0);
      x += width;
    }
  }
  const double parked = values["parked"];
  for (double x = 4.0; x < kStreetLong - 3.0; x += 5.6) {
    for (const bool is_far : {false, true}) {
      if (!to.chance(parked)) continue;
      const double y = is_far ? road - 1.1 : 1.1;
      const int body = to.whole(0, 2);
      const double off = to.between(-0.3, 0.3);
      const auto placed = to.at({x + off, y, 0.0}, is_far ? kPi : 0.0);
      parts::add_car(to, static_cast<parts::CarBody>(body));
    }
  }
  {
    const double x = to.between(20.0, 50.0);
    const auto placed = to.at({x, 0.5 * road, 0.0});
    parts::add_truck(to);
  }
  for (double x = 6.0; x < kStreetLong; x += 14.0) {
    for (const bool is_far : {false, true}) {
      const double y = is_far ? road + 0.6 : -0.6;
      parts::Tree tree;
      tree.height = to.between(6.0, 8.5);
      tree.trunk = 0.13;
      tree.crown = to.between(1.5, 2.1);
      tree.leaves = 900;
      const auto placed = to.at({x, y, 0.14});
      parts::add_broadleaf(to, tree);
    }
    const auto lamp = to.at({x + 7.0, -0.5, 0.14}, 0.5 * kPi);
    parts::add_street_lamp(to, 6.5);
  }
  for (int i = 0; i < 9; ++i) {
    const double x = to.between(2.0, 68.0);
    const double y = to.chance(0.5) ? -1.8 : road + 1.8;
    const auto placed = to.at({x, y, 0.14}, to.chance(0.5) ? 0.0 : kPi);
    parts::add_person(to, 1.75, true);
  }
  for (double x = 11.0; x < kStreetLong; x += 22.0) {
    const auto placed = to.at({x, road + 2.2, 0.14});
    parts::add_table(to, 0.8, 0.8);
    for (const double side : {-0.7, 0.7}) {
      const auto seat = to.at({side, 0, 0}, side > 0 ? kPi : 0.0);
      parts::add_chair(to);
    }
  }
  return box_of({1, -2.5, 0.9}, {kStreetLong - 1, y1 - 0.5, 6.0});
}

}  // namespace

WorldKind street() {
  return {"street",
          "house fronts, parked cars, a lorry, trees, lamps, people on the pavements",
          {70, 33, 16},
          {{"road", "its width, m", 8.0, 11.0},
           {"parked", "share of places with a car", 0.4, 0.85},
           {"floors", "of the highest house", 3, 5, true}},
          build_street,
          {{3, 4, 3}, {40, 5.5, 3.5}}};
}

}  // namespace pointflight::worlds
