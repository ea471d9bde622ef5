#include <cmath>

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

void add_shell(SceneBuilder& to, const Aabb& in, const std::vector<parts::Opening>& front) {
  add_slab(to,
           "floor",
           box_of(in.min - Vector3d(0.2, 0.2, 0.3), {in.max.x() + 0.2, in.max.y() + 0.2, 0}));
  add_slab(to, "ceiling", box_of({-0.2, -0.2, in.max.z()}, in.max + Vector3d(0.2, 0.2, 0.3)));
  const Vector2d a(0, 0);
  const Vector2d b(in.max.x(), 0);
  const Vector2d c(in.max.x(), in.max.y());
  const Vector2d d(0, in.max.y());
  parts::add_wall(to, {a, b, 0, in.max.z(), 0.2, front});
  parts::add_wall(to, {b, c, 0, in.max.z(), 0.2, {}});
  parts::add_wall(to, {d, c, 0, in.max.z(), 0.2, {}});
  parts::add_wall(to, {a, d, 0, in.max.z(), 0.2, {}});
}

/// A tall hall with gantries, ladders, bars from floor to ceiling and cables.
Aabb build_indoor_1(SceneBuilder& to, const WorldValues& values) {
  const Aabb in = box_of({0, 0, 0}, {17, 13, 9});
  add_shell(to, in, {{6.0, 9.5, 0.0, 3.2}});
  for (const double y : {0.0, 11.0}) {
    for (const double z : {3.0, 6.0}) {
      to.begin("floor");
      to.box({0.1, y + 0.1, z - 0.08}, {16.9, y + 1.9, z});
      const double edge = y < 1.0 ? 1.9 : 11.1;
      parts::add_railing(to, {0.1, edge, z}, {16.9, edge, z});
      for (double x = 1.0; x < 17.0; x += 4.0) {
        to.begin("column");
        to.pole({x, edge, z - 3.0}, {x, edge, z - 0.08}, 0.07);
      }
    }
  }
  const int ladders = values.count("ladders");
  for (int i = 0; i < ladders; ++i) {
    const double x = 1.5 + 14.0 * (i + 0.5) / ladders;
    const bool near = to.chance(0.5);
    const double tall = to.chance(0.5) ? 3.9 : 6.9;
    const auto placed = to.at({x, near ? 2.6 : 10.4, 0}, near ? -0.5 * kPi : 0.5 * kPi);
    parts::add_ladder(to, tall, 0.6);
  }
  const int bars = values.count("bars");
  to.begin("pipe");
  for (int i = 0; i < bars; ++i) {
    const double x = to.between(1.0, 16.0);
    const double y = to.between(3.2, 9.8);
    const double radius = to.between(0.012, 0.03);
    to.rod({x, y, 0}, {x, y, 9}, radius);
  }
  for (int i = 0; i < 6; ++i) {
    const double z = to.between(4.0, 8.5);
    const double x = to.between(1.0, 16.0);
    parts::add_pipe(to, {{x, 2.0, z}, {x, 11.0, z}}, 0.04);
  }
  for (int i = 0; i < 3; ++i) {
    const double y = to.between(3.0, 10.0);
    parts::add_wire(to, {0.2, y, 8.2}, {16.8, y, 8.2}, 0.8, 0.01);
  }
  for (int i = 0; i < 4; ++i) {
    const double x = to.between(2.0, 15.0);
    const double y = to.between(4.0, 9.0);
    const auto placed = to.at({x, y, 0}, to.between(0.0, 3.0));
    parts::add_table(to, 1.6, 0.8);
  }
  return box_of({0.7, 0.7, 0.7}, {16.3, 12.3, 8.3});
}

/// A lathe, a mill or a press: a bed, a head, a cabinet, guards.
void add_machine(SceneBuilder& to) {
  const int kind = to.whole(0, 2);
  to.begin("machine");
  if (kind == 0) {
    to.box({-0.4, -1.3, 0.0}, {0.4, 1.3, 0.8});
    to.box({-0.35, -1.3, 0.8}, {0.4, -0.6, 1.45});
    to.pole({0, -0.6, 1.1}, {0, -0.45, 1.1}, 0.18);
    to.box({-0.2, 0.7, 0.8}, {0.2, 1.0, 1.2});
    to.rod({0.1, -0.45, 1.1}, {0.1, 0.7, 1.1}, 0.03);
    to.box({0.2, 0.0, 0.8}, {0.45, 0.25, 1.0});
  } else if (kind == 1) {
    to.box({-0.6, -0.7, 0.0}, {0.6, 0.7, 0.7});
    to.box({-0.6, -0.35, 0.7}, {-0.1, 0.35, 2.2});
    to.box({-0.1, -0.25, 1.5}, {0.5, 0.25, 2.0});
    to.pole({0.3, 0, 1.1}, {0.3, 0, 1.5}, 0.06);
    to.box({-0.05, -0.9, 0.75}, {0.6, 0.9, 0.85});
  } else {
    for (const double y : {-0.7, 0.4}) to.box({-0.4, y, 0.0}, {0.4, y + 0.3, 2.8});
    to.box({-0.45, -0.75, 2.2}, {0.45, 0.75, 3.0});
    to.box({-0.4, -0.4, 0.0}, {0.4, 0.4, 0.75});
    to.box({-0.3, -0.35, 1.5}, {0.3, 0.35, 1.8});
    to.pole({0, 0, 1.8}, {0, 0, 2.2}, 0.12);
  }
}

/// A workshop: machines in rows, a crane on rails, benches, pipes.
Aabb build_indoor_2(SceneBuilder& to, const WorldValues& values) {
  const Aabb in = box_of({0, 0, 0}, {27, 40, 7});
  add_shell(to, in, {{10.0, 16.0, 0.0, 4.5}});
  for (double y = 4.0; y < 40.0; y += 6.0) {
    for (const double x : {0.4, 26.6}) {
      to.begin("column");
      to.box({x - 0.2, y - 0.2, 0}, {x + 0.2, y + 0.2, 7});
    }
    parts::add_girder(to, {0.2, y, 6.3}, {26.8, y, 6.3}, 0.6);
  }
  for (const double x : {0.9, 26.1}) parts::add_girder(to, {x, 0.2, 5.0}, {x, 39.8, 5.0}, 0.5);
  const double crane = values["crane"];
  to.begin("crane");
  for (const double y : {crane - 0.7, crane + 0.3}) to.box({0.7, y, 5.5}, {26.3, y + 0.4, 6.1});
  const double trolley = to.between(6.0, 20.0);
  to.box({trolley - 0.7, crane - 0.7, 5.1}, {trolley + 0.7, crane + 0.7, 5.5});
  to.rod({trolley, crane, 2.6}, {trolley, crane, 5.1}, 0.015);
  to.box({trolley - 0.15, crane - 0.1, 2.2}, {trolley + 0.15, crane + 0.1, 2.6});
  const int rows = values.count("rows");
  for (int row = 0; row < rows; ++row) {
    for (double y = 3.5; y < 37.5; y += 3.2) {
      if (!to.chance(0.85)) continue;
      const double x = 4.0 + 19.0 * row / std::max(1, rows - 1) + to.between(-0.3, 0.3);
      const auto placed = to.at({x, y, 0}, row % 2 == 0 ? 0.0 : kPi);
      add_machine(to);
    }
  }
  for (double y = 3.0; y < 37.0; y += 5.0) {
    const auto placed = to.at({26.2, y, 0}, kPi);
    if (to.chance(0.5)) {
      parts::add_shelf(to, 3.0, 0.6, 2.4, 4);
    } else {
      parts::add_table(to, 3.0, 0.8, 0.9);
    }
  }
  parts::add_pipe(to, {{0.6, 0.5, 4.2}, {0.6, 39.5, 4.2}, {20.0, 39.5, 4.2}}, 0.1);
  parts::add_pipe(to, {{0.6, 0.5, 3.9}, {0.6, 39.2, 3.9}}, 0.04);
  for (int i = 0; i < 5; ++i) {
    const double x = to.between(3.0, 24.0);
    const double y = to.between(2.0, 38.0);
    const auto placed = to.at({x, y, 0}, to.between(-kPi, kPi));
    parts::add_person(to, 1.75, i > 2);
  }
  return box_of({1, 1, 0.8}, {26, 39, 4.8});
}

/// Small rooms behind partitions, doors ajar.
Aabb build_indoor_3(SceneBuilder& to, const WorldValues& values) {
  const Aabb in = box_of({0, 0, 0}, {21, 48, 3});
  add_shell(to, in, {{9.5, 11.5, 0.0, 2.2}});
  const int rows = values.count("rows");
  const double step = 48.0 / rows;
  const double low = 8.5;
  const double high = 12.5;
  for (int i = 0; i < rows; ++i) {
    const double y = step * i;
    for (const bool is_left : {true, false}) {
      const double from = is_left ? 0.0 : high;
      const double until = is_left ? low : 21.0;
      if (i > 0) {
        std::vector<parts::Opening> through;
        if (to.chance(0.5)) through.push_back({3.0, 4.2, 0.0, 2.1});
        parts::add_wall(to, {{from, y}, {until, y}, 0, 3, 0.1, through});
      }
      const double x = is_left ? low : high;
      const double at = to.between(0.6, step - 1.9);
      const parts::Opening door{at, at + 1.2, 0.0, 2.1};
      const parts::Wall wall{{x, y}, {x, y + step}, 0, 3, 0.1, {door}};
      parts::add_wall(to, wall);
      const double open = draw_door_angle(to);
      parts::add_door(to, wall, door, is_left ? open : -open);
      const double middle = 0.5 * (from + until);
      const auto placed = to.at({middle, y + 0.5 * step, 0}, to.chance(0.5) ? 0.0 : 0.5 * kPi);
      const int what = to.whole(0, 3);
      if (what == 0) {
        parts::add_table(to, 2.4, 1.1);
        for (const double side : {-1.0, 1.0}) {
          const auto seat = to.at({side * 0.9, to.between(-0.6, 0.6), 0}, side > 0 ? kPi : 0.0);
          parts::add_chair(to);
        }
      } else if (what == 1) {
        add_workplace(to);
      } else if (what == 2) {
        parts::add_sofa(to);
        const auto beside = to.at({1.3, 0, 0});
        parts::add_table(to, 1.0, 0.6, 0.45);
      } else {
        parts::add_shelf(to, 3.0, 0.5, 2.2, 5);
      }
    }
  }
  add_lamps(to, box_of({low, 0, 0}, {high, 48, 3}), 16, 1);
  return box_of({0.6, 0.6, 0.6}, {20.4, 47.4, 2.5});
}

}  // namespace

WorldKind indoor_1() {
  return {"indoor_1",
          "a tall hall with gantries, ladders, thin bars, cables",
          {17, 13, 9},
          {{"ladders", "how many", 3, 7, true}, {"bars", "from floor to ceiling", 8, 24, true}},
          build_indoor_1,
          {{1, 6.5, 4.5}, {14, 6.5, 3}}};
}

WorldKind indoor_2() {
  return {"indoor_2",
          "a workshop: machines, an overhead crane, benches, pipes",
          {27, 40, 7},
          {{"rows", "of machines", 3, 5, true}, {"crane", "where it stands, m", 8.0, 32.0}},
          build_indoor_2,
          {{1.5, 1.5, 4.2}, {16, 24, 0.5}}};
}

WorldKind indoor_3() {
  return {"indoor_3",
          "rooms behind partitions on both sides of a corridor, doors ajar",
          {21, 48, 3},
          {{"rows", "of rooms", 7, 11, true}},
          build_indoor_3,
          {{10.5, 2, 1.6}, {10.2, 20, 1.3}}};
}

}  // namespace pointflight::worlds
