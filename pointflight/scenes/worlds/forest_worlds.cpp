#include <algorithm>
#include <cmath>

#include "pointflight/core/constants.hpp"
#include "pointflight/core/math.hpp"
#include "pointflight/scenes/parts/plants.hpp"
#include "pointflight/scenes/worlds/rooms.hpp"
#include "pointflight/scenes/worlds/worlds.hpp"

namespace pointflight::worlds {
namespace {

/// What a forest has.
struct Stand {
  double size_x, size_y;  ///< m
  double relief;          ///< Height of its waves, m.
  double trees;           ///< A hectare.
  double spacing;         ///< m
  double height_low, height_high;
  double conifers;  ///< Share.
  int leaves;       ///< Of a tree.
  int bushes, logs, rocks, grass;
};

/// Gentle waves and small ones.
double forest_ground(double relief, double x, double y) {
  return relief * (0.5 * math::sin(0.13 * x) * math::cos(0.11 * y) +
                   0.2 * math::sin(0.5 * x + 0.3 * y) + 0.06 * math::sin(1.7 * x - 1.3 * y));
}

/// Positions at least so far apart.
std::vector<Vector3d> scattered_feet(SceneBuilder& to,
                                     const Stand& stand,
                                     std::size_t wanted,
                                     double spacing) {
  std::vector<Vector3d> feet;
  for (std::size_t tries = 0; feet.size() < wanted && tries < 60 * wanted; ++tries) {
    const double x = to.between(0.6, stand.size_x - 0.6);
    const double y = to.between(0.6, stand.size_y - 0.6);
    const auto is_near = [&](const Vector3d& other) {
      return (other.head<2>() - Vector2d(x, y)).norm() < spacing;
    };
    if (std::any_of(feet.begin(), feet.end(), is_near)) continue;
    feet.emplace_back(x, y, forest_ground(stand.relief, x, y));
  }
  return feet;
}

void add_forest_tree(SceneBuilder& to, const Stand& stand) {
  parts::Tree tree;
  tree.height = to.between(stand.height_low, stand.height_high);
  const double slenderness = to.between(0.011, 0.017);
  tree.trunk = std::clamp(slenderness * tree.height, 0.05, 0.3);
  tree.leaves = stand.leaves;
  if (to.chance(stand.conifers)) {
    tree.crown = to.between(0.12, 0.18) * tree.height;
    tree.crown_from = to.between(0.15, 0.35);
    parts::add_conifer(to, tree);
  } else {
    tree.crown = to.between(0.16, 0.24) * tree.height;
    tree.crown_from = to.between(0.3, 0.5);
    parts::add_broadleaf(to, tree);
  }
}

Aabb build_stand(SceneBuilder& to, const Stand& stand) {
  to.begin("ground");
  to.relief({0, 0}, {stand.size_x, stand.size_y}, 0.3, [&](double x, double y) {
    return forest_ground(stand.relief, x, y);
  });
  const double hectares = stand.size_x * stand.size_y / 10000.0;
  const auto count = static_cast<std::size_t>(stand.trees * hectares);
  for (const Vector3d& foot : scattered_feet(to, stand, count, stand.spacing)) {
    const auto placed = to.at(foot);
    add_forest_tree(to, stand);
  }
  const auto around = [&](int many, double spacing, const auto& add) {
    for (const Vector3d& foot :
         scattered_feet(to, stand, static_cast<std::size_t>(many), spacing)) {
      const double turn = to.between(-kPi, kPi);
      const auto placed = to.at(foot, turn);
      add();
    }
  };
  around(stand.bushes, 1.0, [&] {
    const double radius = to.between(0.4, 1.0);
    parts::add_bush(to, radius, static_cast<int>(260.0 * radius));
  });
  around(stand.logs, 4.0, [&] {
    const double length = to.between(4.0, 10.0);
    const double radius = to.between(0.12, 0.25);
    parts::add_fallen_trunk(to, length, radius);
  });
  around(stand.rocks, 3.0, [&] { parts::add_rock(to, to.between(0.2, 0.7)); });
  around(stand.grass, 0.8, [&] { parts::add_grass(to, 0.6, 60, 0.35); });
  const double top = 0.8 * stand.relief;
  return box_of({1, 1, top + 0.8}, {stand.size_x - 1, stand.size_y - 1, top + 4.0});
}

}  // namespace

WorldKind simple_forest() {
  return {"simple_forest",
          "trunks on nearly level ground, little below the crowns",
          {45, 16, 6},
          {{"trees", "a hectare", 600, 1000}},
          [](SceneBuilder& to, const WorldValues& values) {
            return build_stand(
                to, {45, 16, 0.15, values["trees"], 2.2, 4.5, 6.5, 0.2, 350, 6, 1, 4, 40});
          },
          {{2, 8, 1.8}, {20, 8, 2}}};
}

WorldKind common_forest() {
  return {"common_forest",
          "broadleaf trees and conifers, bushes, a few logs and rocks on relief",
          {48, 27, 19},
          {{"trees", "a hectare", 500, 900}, {"conifers", "their share", 0.2, 0.6}},
          [](SceneBuilder& to, const WorldValues& values) {
            return build_stand(to,
                               {48,
                                27,
                                1.2,
                                values["trees"],
                                2.0,
                                9.0,
                                18.0,
                                values["conifers"],
                                600,
                                40,
                                5,
                                15,
                                120});
          },
          {{3, 13, 2.5}, {25, 13, 4}}};
}

WorldKind dense_forest() {
  return {"dense_forest",
          "trees close together, understorey, fallen trunks, branches down to the ground",
          {30, 72, 19},
          {{"trees", "a hectare", 1000, 1300}, {"conifers", "their share", 0.4, 0.8}},
          [](SceneBuilder& to, const WorldValues& values) {
            return build_stand(to,
                               {30,
                                72,
                                2.0,
                                values["trees"],
                                1.4,
                                7.0,
                                18.0,
                                values["conifers"],
                                450,
                                180,
                                16,
                                30,
                                200});
          },
          {{15, 4, 3}, {15, 30, 4}}};
}

}  // namespace pointflight::worlds
