#include "pointflight/core/constants.hpp"
#include "pointflight/scenes/parts/building.hpp"
#include "pointflight/scenes/parts/furniture.hpp"
#include "pointflight/scenes/parts/plants.hpp"
#include "pointflight/scenes/parts/traffic.hpp"
#include "pointflight/scenes/worlds/rooms.hpp"
#include "pointflight/scenes/worlds/worlds.hpp"

namespace pointflight::worlds {
namespace {

constexpr double kStorey = 3.0;  // m, floor to floor
constexpr double kOfficeLong = 45.0;
constexpr double kOfficeDeep = 16.0;
constexpr double kStairsFrom = 37.5;

/// A room from x0 to x1 on one side of the corridor: desks, shelves, or a meeting table.
void furnish(SceneBuilder& to, const Aabb& room, double people) {
  const double width = room.size().x();
  const double depth = room.size().y();
  if (to.chance(0.25)) {
    const Vector3d middle(room.min.x() + 0.5 * width, room.min.y() + 0.5 * depth, room.min.z());
    const auto placed = to.at(middle);
    parts::add_table(to, 0.55 * depth, 1.2);
    for (const double side : {-1.0, 1.0}) {
      for (double y = -0.2 * depth; y < 0.25 * depth; y += 0.75) {
        const double away = to.between(0.9, 1.2);
        const auto seat = to.at({side * away, y, 0.0}, side > 0 ? kPi : 0.0);
        parts::add_chair(to);
      }
    }
    return;
  }
  for (double x = room.min.x() + 1.7; x < room.max.x() - 1.0; x += 2.4) {
    for (double y = room.min.y() + 1.2; y < room.max.y() - 1.0; y += 2.2) {
      if (!to.chance(0.85)) continue;
      const auto placed = to.at({x, y, room.min.z()}, to.between(-0.03, 0.03));
      add_workplace(to);
      if (to.chance(people)) {
        const auto standing = to.at({-1.2, 0.6, 0.0}, to.between(-1.0, 1.0));
        parts::add_person(to);
      }
    }
  }
  const auto along = to.at({room.max.x() - 0.35, room.min.y() + 0.5 * depth, room.min.z()}, kPi);
  if (to.chance(0.5)) {
    parts::add_shelf(to, 0.5 * depth, 0.4, 1.9, 5);
  } else {
    parts::add_cabinet(to, 0.5 * depth, 0.45, 1.6);
  }
}

/// Where an office is: from x on along the corridor, whose wall is at y.
struct OfficePlace {
  double x, width, y, z;
  bool is_far;
};

/// Walls, door and furniture; some walls to the corridor are glass.
void add_office(SceneBuilder& to, const OfficePlace& at) {
  const double top = at.z + kStorey - 0.3;
  std::vector<parts::Opening> openings = {{0.4, 1.6, 0.0, 2.1}};
  if (to.chance(0.4)) openings.push_back({1.8, at.width - 0.4, 0.1, 2.4, true});
  const parts::Wall front{{at.x, at.y}, {at.x + at.width, at.y}, at.z, top, 0.12, openings};
  parts::add_wall(to, front);
  const double open = draw_door_angle(to);
  if (to.chance(0.8)) parts::add_door(to, front, openings.front(), at.is_far ? open : -open);
  const double y_low = at.is_far ? at.y + 0.1 : 0.2;
  const double y_high = at.is_far ? kOfficeDeep - 0.2 : at.y - 0.1;
  furnish(to, box_of({at.x + 0.2, y_low, at.z}, {at.x + at.width - 0.2, y_high, top}), 0.1);
  const double end = at.x + at.width;
  if (end > kOfficeLong - 0.1) return;
  const double wall_from = at.is_far ? at.y : 0.0;
  const double wall_to = at.is_far ? kOfficeDeep : at.y;
  parts::add_wall(to, {{end, wall_from}, {end, wall_to}, at.z, top, 0.12, {}});
}

void add_office_storey(SceneBuilder& to, double z, const WorldValues& values) {
  const double top = z + kStorey - 0.3;
  const double corridor = values["corridor"];
  const double low = 0.5 * (kOfficeDeep - corridor);
  const double high = low + corridor;
  // facades with ribbons of windows
  std::vector<parts::Opening> ribbon;
  for (double x = 0.6; x + 4.0 < kOfficeLong; x += 4.9) {
    ribbon.push_back({x, x + 4.0, 0.9, 2.3, true});
  }
  parts::add_wall(to, {{0, 0}, {kOfficeLong, 0}, z, top, 0.25, ribbon});
  parts::add_wall(to, {{0, kOfficeDeep}, {kOfficeLong, kOfficeDeep}, z, top, 0.25, ribbon});
  const parts::Opening end{low + 0.3, high - 0.3, z > 0.0 ? 0.9 : 0.0, 2.3, z > 0.0};
  parts::add_wall(to, {{0, 0}, {0, kOfficeDeep}, z, top, 0.25, {end}});
  parts::add_wall(to, {{kOfficeLong, 0}, {kOfficeLong, kOfficeDeep}, z, top, 0.25, {}});
  for (const bool is_far : {false, true}) {
    const double y = is_far ? high : low;
    // stairs take the last of the near rooms
    const double until = is_far ? kOfficeLong : kStairsFrom;
    double x = 0.0;
    while (x < until - 0.1) {
      double width = to.between(4.0, values["room"]);
      if (until - x - width < 3.5) width = until - x;
      add_office(to, {x, width, y, z, is_far});
      x += width;
    }
  }
  add_lamps(to, box_of({0, low, z}, {kOfficeLong, high, top}), 1, 12);
}

Aabb build_large_office(SceneBuilder& to, const WorldValues& values) {
  const double corridor = values["corridor"];
  const double low = 0.5 * (kOfficeDeep - corridor);
  const Aabb hole = box_of({38.5, 2.5, 0}, {43.5, low - 0.8, 0});
  add_slab(to, "floor", box_of({-0.2, -0.2, -0.3}, {kOfficeLong + 0.2, kOfficeDeep + 0.2, 0}));
  add_slab(to,
           "floor",
           box_of({-0.2, -0.2, kStorey - 0.3}, {kOfficeLong + 0.2, kOfficeDeep + 0.2, kStorey}),
           hole);
  add_slab(
      to,
      "ceiling",
      box_of({-0.2, -0.2, 2 * kStorey - 0.3}, {kOfficeLong + 0.2, kOfficeDeep + 0.2, 2 * kStorey}));
  for (const double z : {0.0, kStorey}) add_office_storey(to, z, values);
  {
    const auto placed = to.at({38.7, 0.5 * (hole.min.y() + hole.max.y()), 0.0});
    parts::add_stairs(to, 1.6, kStorey);
  }
  parts::add_railing(
      to, {hole.min.x(), hole.min.y(), kStorey}, {hole.max.x(), hole.min.y(), kStorey});
  parts::add_railing(
      to, {hole.min.x(), hole.max.y(), kStorey}, {hole.max.x(), hole.max.y(), kStorey});
  parts::add_railing(
      to, {hole.min.x(), hole.min.y(), kStorey}, {hole.min.x(), hole.max.y(), kStorey});
  for (double x = 3.0; x < kOfficeLong; x += 7.0) {
    const auto placed = to.at({x, low + 0.45, 0.0});
    to.begin("box");
    to.pole({0, 0, 0}, {0, 0, 0.4}, 0.2, 0.25);
    const auto above = to.at({0, 0, 0.4});
    parts::add_bush(to, 0.55, 120);
  }
  return box_of({0.8, 0.8, 0.6}, {kOfficeLong - 0.8, kOfficeDeep - 0.8, 5.4});
}

}  // namespace

WorldKind large_office() {
  return {"large_office",
          "two storeys, desks, chairs, glass walls, doors ajar, a narrow corridor",
          {45, 16, 6},
          {{"corridor", "its width, m", 1.8, 2.6}, {"room", "the longest, m", 5.0, 9.0}},
          build_large_office,
          {{1.5, 1.2, 1.7}, {9, 4.5, 1}}};
}

}  // namespace pointflight::worlds
