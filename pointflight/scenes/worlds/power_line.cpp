#include "pointflight/core/constants.hpp"
#include "pointflight/core/math.hpp"
#include "pointflight/scenes/parts/plants.hpp"
#include "pointflight/scenes/parts/site.hpp"
#include "pointflight/scenes/worlds/rooms.hpp"
#include "pointflight/scenes/worlds/worlds.hpp"

namespace pointflight::worlds {
namespace {

double field_height(double x, double y) {
  return 1.2 * math::sin(0.05 * x) * math::cos(0.06 * y) + 0.15 * math::sin(0.6 * x + 0.4 * y);
}

/// Three pylons in a row, six wires and an earth wire, trees and bushes below.
Aabb build_power_line(SceneBuilder& to, const WorldValues& values) {
  constexpr double kLong = 130.0;  // m
  constexpr double kWide = 50.0;
  to.begin("ground");
  to.relief({0, 0}, {kLong, kWide}, 0.5, field_height);
  const double tall = values["height"];
  const double span = 55.0;
  std::vector<std::vector<Vector3d>> ends;
  for (int i = 0; i < 3; ++i) {
    const Vector3d foot(10.0 + span * i, 0.5 * kWide, field_height(10.0 + span * i, 0.5 * kWide));
    const auto placed = to.at(foot);
    std::vector<Vector3d> wires = parts::add_pylon(to, tall);
    for (Vector3d& w : wires) w += foot;
    ends.push_back(std::move(wires));
  }
  const double sag = values["sag"];
  const double radius = 0.5 * values["wire"];
  for (std::size_t i = 0; i + 1 < ends.size(); ++i) {
    for (std::size_t k = 0; k < ends[i].size(); ++k) {
      const bool is_earth = k + 1 == ends[i].size();
      parts::add_wire(to,
                      ends[i][k],
                      ends[i + 1][k],
                      is_earth ? 0.7 * sag : sag,
                      is_earth ? 0.6 * radius : radius);
    }
  }
  const int trees = values.count("trees");
  for (int i = 0; i < trees; ++i) {
    const double x = to.between(3.0, kLong - 3.0);
    const double beside = to.between(6.0, 22.0);
    const double y = 0.5 * kWide + (to.chance(0.5) ? beside : -beside);
    parts::Tree tree;
    tree.height = beside < 11.0 ? to.between(3.0, 5.0) : to.between(6.0, 13.0);
    tree.trunk = 0.016 * tree.height;
    tree.crown = 0.22 * tree.height;
    tree.leaves = 700;
    const bool is_conifer = to.chance(0.4);
    const auto placed = to.at({x, y, field_height(x, y)});
    if (is_conifer) {
      tree.crown_from = 0.15;
      parts::add_conifer(to, tree);
    } else {
      parts::add_broadleaf(to, tree);
    }
  }
  for (int i = 0; i < 60; ++i) {
    const double x = to.between(2.0, kLong - 2.0);
    const double y = to.between(2.0, kWide - 2.0);
    const double size = to.between(0.4, 1.1);
    const auto placed = to.at({x, y, field_height(x, y)});
    parts::add_bush(to, size, static_cast<int>(220.0 * size));
  }
  return box_of({2, 2, 2.0}, {kLong - 2, kWide - 2, 14.0});
}

}  // namespace

WorldKind power_line() {
  return {"power_line",
          "three pylons, wires of 1 to 3 cm that sag, trees below",
          {130, 50, 30},
          {{"height", "of the pylons, m", 24.0, 30.0},
           {"sag", "of the wires, m", 1.5, 3.0},
           {"wire", "thickness, m", 0.015, 0.03},
           {"trees", "how many", 30, 60, true}},
          build_power_line,
          {{20, 12, 8}, {60, 25, 14}}};
}

}  // namespace pointflight::worlds
