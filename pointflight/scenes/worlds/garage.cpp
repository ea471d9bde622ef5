#include <algorithm>

#include "pointflight/core/constants.hpp"
#include "pointflight/scenes/parts/building.hpp"
#include "pointflight/scenes/parts/traffic.hpp"
#include "pointflight/scenes/worlds/rooms.hpp"
#include "pointflight/scenes/worlds/worlds.hpp"

namespace pointflight::worlds {
namespace {

/// A row of parking bays along x from `from`, cars with their rear to the wall.
void add_bays(SceneBuilder& to, const Vector3d& from, int bays, double occupied, double yaw) {
  constexpr double kBay = 2.5;  // m
  for (int i = 0; i < bays; ++i) {
    if (!to.chance(occupied)) continue;
    const int kind = to.whole(0, 2);
    const double askew = to.between(-0.04, 0.04);
    const double beside = to.between(-0.15, 0.15);
    const double backwards = to.chance(0.3) ? kPi : 0.0;
    const auto placed =
        to.at(from + Vector3d(kBay * (i + 0.5) + beside, 0, 0), yaw + askew + backwards);
    parts::add_car(to, static_cast<parts::CarBody>(kind));
  }
}

/// Pillars, beams, pipes, lamps and walls of a storey between two slabs.
void add_storey(SceneBuilder& to, const Aabb& inside, double pillar) {
  const double half = 0.5 * pillar;
  for (double x = inside.min.x() + 7.5; x < inside.max.x() - 3.0; x += 7.5) {
    for (const double share : {0.33, 0.67}) {
      const double y = inside.min.y() + share * inside.size().y();
      to.begin("column");
      to.box({x - half, y - half, inside.min.z()}, {x + half, y + half, inside.max.z()});
    }
    to.begin("beam");
    to.box({x - half, inside.min.y(), inside.max.z() - 0.45},
           {x + half, inside.max.y(), inside.max.z()});
  }
  const double z = inside.max.z() - 0.6;
  for (const double y : {inside.min.y() + 0.5, inside.max.y() - 0.7}) {
    parts::add_pipe(to, {{inside.min.x(), y, z}, {inside.max.x(), y, z}}, 0.08);
    parts::add_pipe(
        to, {{inside.min.x(), y + 0.25, z + 0.05}, {inside.max.x(), y + 0.25, z + 0.05}}, 0.03);
  }
  add_lamps(to, inside, 2, static_cast<int>(inside.size().x() / 5.0));
}

void add_outer_walls(SceneBuilder& to,
                     const Aabb& in,
                     const std::vector<parts::Opening>& at_low_x) {
  const Vector2d a(in.min.x(), in.min.y());
  const Vector2d b(in.max.x(), in.min.y());
  const Vector2d c(in.max.x(), in.max.y());
  const Vector2d d(in.min.x(), in.max.y());
  const double low = in.min.z();
  const double high = in.max.z();
  parts::add_wall(to, {a, b, low, high, 0.25, {}});
  parts::add_wall(to, {b, c, low, high, 0.25, {{2.0, 2.9, 0.0, 2.05}}});
  parts::add_wall(to, {c, d, low, high, 0.25, {}});
  parts::add_wall(to, {a, d, low, high, 0.25, at_low_x});
}

const std::vector<WorldParameter> kGarageParameters = {
    {"occupied", "share of bays with a car", 0.45, 0.9},
    {"pillar", "width of pillars, m", 0.4, 0.7}};

Aabb build_simple(SceneBuilder& to, const WorldValues& values) {
  const Aabb inside = box_of({0, 0, 0}, {45, 15, 3.2});
  add_slab(to, "floor", box_of({-0.2, -0.2, -0.3}, {45.2, 15.2, 0}));
  add_slab(to, "ceiling", box_of({-0.2, -0.2, 3.2}, {45.2, 15.2, 3.6}));
  add_outer_walls(to, inside, {{5.0, 10.0, 0.0, 2.6}});
  add_storey(to, inside, values["pillar"]);
  const double occupied = values["occupied"];
  add_bays(to, {1.5, 2.8, 0}, 16, occupied, 0.5 * kPi);
  add_bays(to, {1.5, 12.2, 0}, 16, occupied, -0.5 * kPi);
  // the way in and the ramp outside
  to.begin("road");
  to.profile({{0.0, -0.3}, {0.0, 0.0}, {-8.0, 1.2}, {-8.0, -0.3}}, 5.0, 10.0);
  return box_of({1, 1, 0.8}, {44, 14, 2.4});
}

Aabb build_complex(SceneBuilder& to, const WorldValues& values) {
  const double occupied = values["occupied"];
  const Aabb ramp = box_of({24, 4.0, 0}, {38, 8.0, 9});
  for (int level = 0; level < 2; ++level) {
    const double z = 4.6 * level;
    const Aabb inside = box_of({0, 0, z}, {62, 12, z + 4.2});
    if (level == 0) {
      add_slab(to, "floor", box_of({-0.2, -0.2, z - 0.4}, {62.2, 12.2, z}));
    } else {
      add_slab(to, "floor", box_of({-0.2, -0.2, z - 0.4}, {62.2, 12.2, z}), ramp);
      parts::add_railing(to, {ramp.min.x(), ramp.min.y(), z}, {ramp.max.x(), ramp.min.y(), z});
      parts::add_railing(to, {ramp.min.x(), ramp.max.y(), z}, {ramp.max.x(), ramp.max.y(), z});
    }
    add_outer_walls(to, inside, {{4.0, 8.5, 0.0, 2.8}});
    add_storey(to, inside, values["pillar"]);
    add_bays(to, {2.0, 2.6, z}, 8, occupied, 0.5 * kPi);
    add_bays(to, {2.0, 9.4, z}, 8, occupied, -0.5 * kPi);
    add_bays(to, {40.0, 2.6, z}, 8, occupied, 0.5 * kPi);
    add_bays(to, {40.0, 9.4, z}, 8, occupied, -0.5 * kPi);
    // ducts that branch
    const double duct = z + 3.5;
    to.begin("pipe");
    to.box({3.0, 5.6, duct}, {59.0, 6.4, duct + 0.45});
    for (double x = 6.0; x < 58.0; x += 9.0)
      to.box({x, 1.0, duct + 0.1}, {x + 0.4, 5.6, duct + 0.4});
  }
  add_slab(to, "ceiling", box_of({-0.2, -0.2, 8.8}, {62.2, 12.2, 9.2}));
  to.begin("road");
  to.profile(
      {{ramp.min.x(), 0.0}, {ramp.max.x(), 0.0}, {ramp.max.x(), 4.6}, {ramp.max.x() - 0.3, 4.6}},
      ramp.min.y(),
      ramp.max.y());
  return box_of({1, 1, 0.8}, {61, 11, 8.0});
}

}  // namespace

WorldKind simple_garage() {
  return {"simple_garage",
          "one storey of parking, pillars, beams, pipes, cars",
          {45, 15, 4},
          kGarageParameters,
          build_simple,
          {{2, 7.5, 1.7}, {20, 7.5, 1.2}}};
}

WorldKind complex_garage() {
  return {"complex_garage",
          "two storeys of parking, a ramp, ducts, pipes, cars",
          {62, 12, 10},
          kGarageParameters,
          build_complex,
          {{12, 6, 1.8}, {34, 6, 2.2}}};
}

}  // namespace pointflight::worlds
