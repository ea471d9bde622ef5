#include <cmath>

#include "pointflight/core/constants.hpp"
#include "pointflight/scenes/parts/building.hpp"
#include "pointflight/scenes/parts/furniture.hpp"
#include "pointflight/scenes/worlds/rooms.hpp"
#include "pointflight/scenes/worlds/worlds.hpp"

namespace pointflight::worlds {
namespace {

constexpr double kNaveLong = 47.0;  // m
constexpr double kNaveDeep = 20.0;
constexpr double kGallery = 7.2;
constexpr double kNaveWalls = 15.0;
constexpr double kAisle = 5.0;

/// A storey of the arcade along x at y: columns or piers, arches between them.
void add_arcade(
    SceneBuilder& to, double y, double z, double bay, double half, double column, double top) {
  const double spring = top - half - 0.8;
  for (double x = 0.5 * bay; x < kNaveLong; x += bay) {
    {
      const auto placed = to.at({x, y, z}, 0.5 * kPi);
      parts::add_arch(to, half, spring, top, 0.7);
    }
    if (x + 0.5 * bay < kNaveLong - 0.5) {
      const auto placed = to.at({x + 0.5 * bay, y, z});
      parts::add_column(to, column, spring);
      to.begin("wall");
      const double pier = 0.5 * bay - half;
      to.box({-pier, -0.35, spring}, {pier, 0.35, top});
    }
  }
}

/// Outer walls with tall windows in two rows.
void add_basilica_walls(SceneBuilder& to, int bays) {
  const double bay = kNaveLong / bays;
  std::vector<parts::Opening> windows;
  for (int i = 0; i < bays; ++i) {
    const double x = bay * (i + 0.5);
    windows.push_back({x - 0.8, x + 0.8, 2.2, 5.6, true, 0.8});
  }
  std::vector<parts::Opening> upper = windows;
  for (parts::Opening& o : upper) o.top = 6.0;
  for (const double y : {0.0, kNaveDeep}) {
    parts::add_wall(to, {{0, y}, {kNaveLong, y}, 0.0, kGallery, 0.9, windows});
    parts::add_wall(to, {{0, y}, {kNaveLong, y}, kGallery, kNaveWalls, 0.9, upper});
  }
  parts::add_wall(to,
                  {{0, 0}, {0, kNaveDeep}, 0.0, kNaveWalls + 6.0, 0.9, {{8.0, 12.0, 0.0, 5.0}}});
  parts::add_wall(to,
                  {{kNaveLong, 0},
                   {kNaveLong, kNaveDeep},
                   0.0,
                   kNaveWalls + 6.0,
                   0.9,
                   {{8.5, 11.5, 9.0, 14.0, true}}});
}

/// Galleries above the aisles, vaults below them and over the nave, the roof.
void add_basilica_vaults(SceneBuilder& to, int bays) {
  const double bay = kNaveLong / bays;
  for (const bool is_left : {true, false}) {
    const double y0 = is_left ? 0.0 : kNaveDeep - kAisle;
    add_slab(to, "floor", box_of({0, y0, kGallery - 0.35}, {kNaveLong, y0 + kAisle, kGallery}));
    add_slab(
        to, "ceiling", box_of({0, y0, kNaveWalls - 0.3}, {kNaveLong, y0 + kAisle, kNaveWalls}));
    for (int i = 0; i < bays; ++i) {
      const auto placed = to.at({bay * (i + 0.5), y0 + 0.5 * kAisle, 4.4});
      parts::add_groin_vault(to, 0.5 * kAisle, 2.3);
    }
  }
  const double wide = kNaveDeep - 2.0 * kAisle;
  const int vaults = static_cast<int>(std::lround(kNaveLong / wide));
  for (int i = 0; i < vaults; ++i) {
    const double along = kNaveLong / vaults;
    const auto placed = to.at({along * (i + 0.5), 0.5 * kNaveDeep, kNaveWalls});
    parts::add_groin_vault(to, 0.5 * wide, 5.0);
  }
  for (const double y : {kAisle, kNaveDeep - kAisle}) {
    to.begin("wall");
    to.box({0, y - 0.35, kNaveWalls}, {kNaveLong, y + 0.35, kNaveWalls + 6.0});
  }
  add_slab(to,
           "roof",
           box_of({-0.5, kAisle - 0.5, kNaveWalls + 6.0},
                  {kNaveLong + 0.5, kNaveDeep - kAisle + 0.5, kNaveWalls + 6.5}));
}

/// Steps to the choir with an altar, stairs, pews.
void furnish_basilica(SceneBuilder& to, double from_pew_to_pew) {
  for (int i = 0; i < 4; ++i) {
    to.begin("stairs");
    to.box({kNaveLong - 7.0 + 0.4 * i, kAisle + 0.4, 0.17 * i},
           {kNaveLong - 0.5, kNaveDeep - kAisle - 0.4, 0.17 * (i + 1)});
  }
  {
    const auto placed = to.at({kNaveLong - 3.0, 0.5 * kNaveDeep, 0.7});
    parts::add_table(to, 3.0, 1.1, 1.0);
  }
  {
    const auto placed = to.at({1.2, 1.4, 0.0});
    parts::add_stairs(to, 1.6, 3.6);
  }
  for (double x = 6.0; x < kNaveLong - 10.0; x += from_pew_to_pew) {
    for (const double y : {kAisle + 1.2, 0.5 * kNaveDeep + 0.9}) {
      to.begin("bench");
      to.box({x, y, 0.42}, {x + 0.4, y + 2.9, 0.47});
      to.box({x, y, 0.47}, {x + 0.05, y + 2.9, 0.95});
      for (const double at : {0.0, 2.8}) to.box({x, y + at, 0.0}, {x + 0.4, y + at + 0.1, 0.42});
    }
  }
}

/// Nave and aisles of a basilica with two storeys of arcades.
Aabb build_historical_building(SceneBuilder& to, const WorldValues& values) {
  const int bays = values.count("bays");
  const double bay = kNaveLong / bays;
  const double column = values["column"];
  const double half = 0.5 * bay - 1.3 * column;
  add_slab(to, "floor", box_of({-0.5, -0.5, -0.4}, {kNaveLong + 0.5, kNaveDeep + 0.5, 0.0}));
  add_basilica_walls(to, bays);
  for (const double y : {kAisle, kNaveDeep - kAisle}) {
    add_arcade(to, y, 0.0, bay, half, column, kGallery);
    add_arcade(to, y, kGallery, bay, half, 0.75 * column, kNaveWalls - kGallery);
    // the gallery's balustrade, bay by bay
    for (int i = 0; i < bays; ++i) {
      const auto placed = to.at({bay * (i + 0.5) + half, y, kGallery}, 0.5 * kPi);
      parts::add_balustrade(to, 2.0 * half);
    }
  }
  add_basilica_vaults(to, bays);
  furnish_basilica(to, values["pews"]);
  return box_of({1.2, 1.2, 1.2}, {kNaveLong - 1.2, kNaveDeep - 1.2, 14.0});
}

}  // namespace

WorldKind historical_building() {
  return {"historical_building",
          "a basilica: two storeys of arcades, groined vaults, columns, balustrades, stairs, pews",
          {47, 20, 22},
          {{"bays", "of the arcades", 7, 11, true},
           {"column", "radius of columns, m", 0.35, 0.5},
           {"pews", "from one to the next, m", 1.2, 1.8}},
          build_historical_building,
          {{4, 10, 3}, {40, 10, 6}}};
}

}  // namespace pointflight::worlds
