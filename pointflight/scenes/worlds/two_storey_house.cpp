#include "pointflight/core/constants.hpp"
#include "pointflight/core/math.hpp"
#include "pointflight/scenes/parts/building.hpp"
#include "pointflight/scenes/parts/furniture.hpp"
#include "pointflight/scenes/parts/plants.hpp"
#include "pointflight/scenes/parts/traffic.hpp"
#include "pointflight/scenes/worlds/rooms.hpp"
#include "pointflight/scenes/worlds/worlds.hpp"

namespace pointflight::worlds {
namespace {

constexpr double kHouseX = 12.0;  // m
constexpr double kHouseY = 9.0;
constexpr double kHouseStorey = 2.8;

void add_house_walls(SceneBuilder& to, double z, bool is_ground) {
  const double top = z + kHouseStorey - 0.25;
  const std::vector<parts::Opening> front = {{1.0, 3.0, 0.9, 2.2, true},
                                             {5.0, 6.2, is_ground ? 0.0 : 0.9, 2.2, !is_ground},
                                             {8.0, 10.8, 0.9, 2.2, true}};
  const std::vector<parts::Opening> back = {{1.5, 4.5, is_ground ? 0.0 : 0.9, 2.3, !is_ground},
                                            {7.0, 9.0, 0.9, 2.2, true}};
  const std::vector<parts::Opening> side = {{3.0, 5.0, 0.9, 2.2, true}};
  parts::add_wall(to, {{0, 0}, {kHouseX, 0}, z, top, 0.3, front});
  parts::add_wall(to, {{0, kHouseY}, {kHouseX, kHouseY}, z, top, 0.3, back});
  parts::add_wall(to, {{0, 0}, {0, kHouseY}, z, top, 0.3, side});
  parts::add_wall(to, {{kHouseX, 0}, {kHouseX, kHouseY}, z, top, 0.3, side});
  // rooms: a wall across with a wide opening, one along with a door
  parts::add_wall(to, {{7.2, 0}, {7.2, kHouseY}, z, top, 0.12, {{3.6, 4.8, 0.0, 2.1}}});
  const parts::Wall along{{7.2, 5.0}, {kHouseX, 5.0}, z, top, 0.12, {{0.6, 1.7, 0.0, 2.1}}};
  parts::add_wall(to, along);
  parts::add_door(to, along, along.openings.front(), to.between(1.2, 2.0));
}

void furnish_house(SceneBuilder& to) {
  {
    const auto placed = to.at({2.2, 7.6, 0.0}, -0.5 * kPi);
    parts::add_sofa(to, 2.2);
  }
  {
    const auto placed = to.at({2.2, 6.0, 0.0});
    parts::add_table(to, 1.1, 0.7, 0.45);
  }
  {
    const auto placed = to.at({2.6, 2.2, 0.0}, to.between(-0.2, 0.2));
    parts::add_table(to, 1.8, 0.9);
    for (const double side : {-1.0, 1.0}) {
      for (const double y : {-0.5, 0.4}) {
        const auto seat = to.at({0.75 * side, y, 0.0}, side > 0 ? kPi : 0.0);
        parts::add_chair(to);
      }
    }
  }
  {
    const auto placed = to.at({11.5, 2.5, 0.0}, kPi);
    parts::add_cabinet(to, 3.4, 0.6, 0.9);
  }
  {
    const auto placed = to.at({9.6, 8.5, 0.0}, -0.5 * kPi);
    parts::add_shelf(to, 2.4, 0.35, 2.0, 5);
  }
  for (const double z : {kHouseStorey}) {
    {
      const auto placed = to.at({1.5, 2.0, z});
      parts::add_bed(to);
    }
    {
      const auto placed = to.at({10.7, 2.2, z}, kPi);
      parts::add_bed(to, 2.0, 1.2);
    }
    {
      const auto placed = to.at({11.4, 7.0, z}, kPi);
      add_workplace(to);
    }
    const auto placed = to.at({0.6, 7.0, z});
    parts::add_cabinet(to, 2.0, 0.6, 2.0);
  }
}

/// A gabled roof and a chimney.
void add_house_roof(SceneBuilder& to, double ridge) {
  const double eaves = 2 * kHouseStorey;
  to.begin("roof");
  const double middle = 0.5 * kHouseX;
  for (const double side : {-1.0, 1.0}) {
    const double end = middle + side * (middle + 0.6);
    to.profile({{end, eaves - 0.1},
                {middle, eaves + ridge},
                {middle, eaves + ridge - 0.25},
                {end, eaves - 0.35}},
               -0.6,
               kHouseY + 0.6);
  }
  for (const double y : {0.0, kHouseY}) {
    to.triangle({0, y, eaves}, {kHouseX, y, eaves}, {0.5 * kHouseX, y, eaves + ridge - 0.25});
  }
  to.box({8.5, 4.0, eaves}, {9.2, 4.7, eaves + ridge + 0.6});
}

/// Trees, a hedge, a fence, a car.
void add_garden(SceneBuilder& to, int trees) {
  for (int i = 0; i < trees; ++i) {
    const bool is_behind = to.chance(0.5);
    const double x = to.between(-7.0, 19.0);
    const double y = is_behind ? to.between(12.5, 16.0) : to.between(-7.5, -4.5);
    parts::Tree tree;
    tree.height = to.between(4.0, 7.0);
    tree.trunk = 0.12;
    tree.crown = to.between(1.2, 2.0);
    tree.leaves = 900;
    const auto placed = to.at({x, y, -0.1});
    parts::add_broadleaf(to, tree);
  }
  for (int i = 0; i < 14; ++i) {
    const auto placed = to.at({-8.0 + 2.1 * i, 17.2, -0.1});
    parts::add_bush(to, 0.8, 250);
  }
  parts::add_railing(to, {-8.5, -8.5, -0.1}, {20.5, -8.5, -0.1}, 1.1);
  const auto placed = to.at({16.5, -3.0, -0.05}, 0.5 * kPi);
  parts::add_car(to, parts::CarBody::kHatchback);
}

Aabb build_two_storey_house(SceneBuilder& to, const WorldValues& values) {
  to.begin("ground");
  to.relief({-9, -9}, {21, 18}, 0.5, [](double x, double y) {
    return -0.12 + 0.05 * math::sin(0.6 * x) * math::cos(0.5 * y);
  });
  add_slab(to, "floor", box_of({-0.15, -0.15, -0.2}, {kHouseX + 0.15, kHouseY + 0.15, 0.0}));
  const Aabb hole = box_of({3.6, 3.7, 0}, {7.0, 5.0, 0});
  add_slab(
      to,
      "floor",
      box_of({-0.15, -0.15, kHouseStorey - 0.25}, {kHouseX + 0.15, kHouseY + 0.15, kHouseStorey}),
      hole);
  add_slab(to,
           "ceiling",
           box_of({-0.15, -0.15, 2 * kHouseStorey - 0.25},
                  {kHouseX + 0.15, kHouseY + 0.15, 2 * kHouseStorey}));
  add_house_walls(to, 0.0, true);
  add_house_walls(to, kHouseStorey, false);
  {
    const auto placed = to.at({3.0, 4.35, 0.0});
    parts::add_stairs(to, 1.0, kHouseStorey, 0.25);
  }
  parts::add_railing(to,
                     {hole.min.x(), hole.min.y(), kHouseStorey},
                     {hole.max.x(), hole.min.y(), kHouseStorey},
                     0.9);
  parts::add_railing(to,
                     {hole.min.x(), hole.max.y(), kHouseStorey},
                     {hole.max.x(), hole.max.y(), kHouseStorey},
                     0.9);
  furnish_house(to);
  add_house_roof(to, values["ridge"]);
  add_garden(to, values.count("trees"));
  return box_of({-8, -8, 0.6}, {20, 17, 5.2});
}

}  // namespace

WorldKind two_storey_house() {
  return {"two_storey_house",
          "rooms on two floors, stairs, windows, a gabled roof, a garden",
          {30, 27, 9},
          {{"ridge", "height of the roof, m", 2.4, 3.6}, {"trees", "in the garden", 4, 9, true}},
          build_two_storey_house,
          {{0.8, 1, 1.7}, {6, 6, 1.1}}};
}

}  // namespace pointflight::worlds
