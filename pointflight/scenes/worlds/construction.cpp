#include "pointflight/core/constants.hpp"
#include "pointflight/core/math.hpp"
#include "pointflight/scenes/parts/building.hpp"
#include "pointflight/scenes/parts/furniture.hpp"
#include "pointflight/scenes/parts/site.hpp"
#include "pointflight/scenes/parts/traffic.hpp"
#include "pointflight/scenes/worlds/rooms.hpp"
#include "pointflight/scenes/worlds/worlds.hpp"

namespace pointflight::worlds {
namespace {

/// Bars that stand out of a column or a slab's edge.
void add_rebar(SceneBuilder& to, const Vector3d& foot, double height) {
  to.begin("rebar");
  for (const double x : {-0.15, 0.15}) {
    for (const double y : {-0.15, 0.0, 0.15}) {
      to.rod(foot + Vector3d(x, y, 0), foot + Vector3d(x, y, height), 0.008);
    }
  }
  for (const double z : {0.2, 0.5}) {
    to.rod(foot + Vector3d(-0.15, -0.15, z), foot + Vector3d(0.15, -0.15, z), 0.005);
    to.rod(foot + Vector3d(-0.15, 0.15, z), foot + Vector3d(0.15, 0.15, z), 0.005);
  }
}

/// A mat of bars, 20 cm apart.
void add_bar_mat(SceneBuilder& to, const Vector3d& corner, double size_x, double size_y) {
  to.begin("rebar");
  for (double x = 0.0; x <= size_x; x += 0.2) {
    to.rod(corner + Vector3d(x, 0, 0), corner + Vector3d(x, size_y, 0), 0.006);
  }
  for (double y = 0.0; y <= size_y; y += 0.2) {
    to.rod(corner + Vector3d(0, y, 0.012), corner + Vector3d(size_x, y, 0.012), 0.006);
  }
}

/// A net of strings, 12 cm apart, in the plane x = 0.
void add_net(SceneBuilder& to, double length, double height) {
  to.begin("net");
  for (double y = 0.0; y <= length; y += 0.12) to.rod({0, y, 0}, {0, y, height}, 0.0025);
  for (double z = 0.0; z <= height; z += 0.12) to.rod({0, 0, z}, {0, length, z}, 0.0025);
}

constexpr double kShellFloor = 3.4;  // m, floor to floor
constexpr double kShellLong = 24.0;
constexpr double kShellDeep = 14.0;

/// Slabs, columns, stairs and railings; the top storey is half done, bars stand out of it.
void add_skeleton(SceneBuilder& to, int floors) {
  const Aabb shaft = box_of({10, 5.5, 0}, {13, 8.5, 0});
  for (int level = 0; level <= floors; ++level) {
    const double z = kShellFloor * level;
    const double until = level == floors ? 14.0 : kShellLong;
    add_slab(
        to, "floor", box_of({0, 0, z - 0.25}, {until, kShellDeep, z}), level > 0 ? shaft : Aabb{});
    for (double x = 0.4; x < until; x += 5.8) {
      for (double y = 0.4; y < kShellDeep; y += 6.6) {
        if (level < floors && (level + 1 < floors || x < 14.0)) {
          to.begin("column");
          to.box({x - 0.2, y - 0.2, z}, {x + 0.2, y + 0.2, z + kShellFloor - 0.25});
        } else {
          add_rebar(to, {x, y, z}, 0.9);
        }
      }
    }
    if (level + 1 < floors) {
      const auto placed = to.at({10.0, 5.6, z});
      parts::add_stairs(to, 1.2, kShellFloor, 0.15);
    }
    if (level > 0) {
      parts::add_railing(to, {0.1, 0.1, z}, {until, 0.1, z});
      parts::add_railing(to, {0.1, kShellDeep - 0.1, z}, {until, kShellDeep - 0.1, z});
    }
  }
}

/// Scaffold, net, bars on the top slab and a crane beside it.
void add_works(SceneBuilder& to, int floors, double crane) {
  add_bar_mat(to, {14.2, 0.5, kShellFloor * floors + 0.1}, 6.0, 12.0);
  {
    const auto placed = to.at({-1.3, 0.0, -0.1});
    parts::add_scaffold(to, 5, floors);
  }
  {
    const auto placed = to.at({0.0, kShellDeep + 0.3, -0.1}, 0.5 * kPi);
    const auto mirrored = to.at({0.0, -kShellLong, 0.0});
    parts::add_scaffold(to, 9, floors);
  }
  {
    const auto placed = to.at({kShellLong + 0.4, 1.0, 0.0});
    add_net(to, 12.0, kShellFloor * (floors - 1));
  }
  {
    const double turn = to.between(-kPi, kPi);
    const auto placed = to.at({30.0, 22.0, -0.1}, turn);
    parts::add_tower_crane(to, crane, 24.0);
  }
}

/// Containers, stacks, a lorry, people, a ladder.
void add_site_things(SceneBuilder& to, int floors) {
  for (int i = 0; i < 3; ++i) {
    const double turn = to.between(-0.1, 0.1);
    const auto placed = to.at({-8.0, -6.0 + 8.0 * i, -0.05}, turn);
    to.begin("container");
    to.box({-1.22, -3.0, 0.0}, {1.22, 3.0, 2.6});
  }
  for (int i = 0; i < 8; ++i) {
    const double x = to.between(0.0, 24.0);
    const double tall = to.between(0.4, 1.4);
    const auto placed = to.at({x, -6.0 + (i % 2) * 2.4, -0.1}, to.between(-0.3, 0.3));
    parts::add_pallet(to, tall);
  }
  {
    const auto placed = to.at({8.0, -9.5, -0.1}, 0.1);
    parts::add_truck(to);
  }
  for (int i = 0; i < 6; ++i) {
    const double x = to.between(1.0, 12.0);
    const double y = to.between(1.0, 5.0);
    const int level = to.whole(0, floors);
    const auto placed = to.at({x, y, kShellFloor * level}, to.between(-kPi, kPi));
    parts::add_person(to);
  }
  {
    const auto placed = to.at({20.0, -1.0, -0.1}, 0.5 * kPi);
    parts::add_ladder(to, 3.8, 0.9);
  }
}

Aabb build_construction(SceneBuilder& to, const WorldValues& values) {
  to.begin("ground");
  to.relief({-12, -12}, {38, 30}, 0.5, [](double x, double y) {
    return -0.15 + 0.08 * math::sin(0.7 * x) * math::cos(0.6 * y) +
           0.04 * math::sin(2.1 * x + 1.4 * y);
  });
  const int floors = values.count("floors");
  add_skeleton(to, floors);
  add_works(to, floors, values["crane"]);
  add_site_things(to, floors);
  return box_of({-11, -11, 0.8}, {37, 29, 12.0});
}

}  // namespace

WorldKind construction() {
  return {"construction",
          "a concrete skeleton, scaffold, rebar, netting, a tower crane, containers",
          {50, 42, 30},
          {{"floors", "that stand", 3, 5, true}, {"crane", "its height, m", 22.0, 28.0}},
          build_construction,
          {{-8, -9, 7}, {14, 8, 7}}};
}

}  // namespace pointflight::worlds
