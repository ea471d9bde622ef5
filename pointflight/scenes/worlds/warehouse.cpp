#include <cmath>

#include "pointflight/core/constants.hpp"
#include "pointflight/scenes/parts/building.hpp"
#include "pointflight/scenes/parts/site.hpp"
#include "pointflight/scenes/parts/traffic.hpp"
#include "pointflight/scenes/worlds/rooms.hpp"
#include "pointflight/scenes/worlds/worlds.hpp"

namespace pointflight::worlds {
namespace {

void add_storage_hall(SceneBuilder& to, const Aabb& in) {
  add_slab(to,
           "floor",
           box_of(in.min - Vector3d(0.2, 0.2, 0.3), {in.max.x() + 0.2, in.max.y() + 0.2, 0}));
  const Vector2d a(in.min.x(), in.min.y());
  const Vector2d b(in.max.x(), in.min.y());
  const Vector2d c(in.max.x(), in.max.y());
  const Vector2d d(in.min.x(), in.max.y());
  std::vector<parts::Opening> docks;
  for (double y = 3.0; y + 3.0 < in.max.y(); y += 5.5) docks.push_back({y, y + 3.0, 0.0, 3.4});
  parts::add_wall(to, {a, d, 0.0, in.max.z(), 0.2, docks});
  parts::add_wall(to, {a, b, 0.0, in.max.z(), 0.2, {}});
  parts::add_wall(to, {b, c, 0.0, in.max.z(), 0.2, {{2.0, 3.0, 0.0, 2.1}}});
  parts::add_wall(to, {d, c, 0.0, in.max.z(), 0.2, {}});
  // every other dock has its gate down
  for (std::size_t i = 0; i < docks.size(); i += 2) {
    to.begin("door");
    to.box({-0.05, docks[i].from, 0.0}, {0.05, docks[i].to, 3.4});
  }
  // a roof on trusses
  to.begin("roof");
  const double middle = 0.5 * in.max.y();
  const double ridge = in.max.z() + 1.2;
  to.rectangle({in.min.x(), 0, in.max.z()}, {in.size().x(), 0, 0}, {0, middle, 1.2});
  to.rectangle({in.min.x(), in.max.y(), in.max.z()}, {in.size().x(), 0, 0}, {0, -middle, 1.2});
  for (double x = in.min.x() + 4.0; x < in.max.x(); x += 6.0) {
    to.begin("girder");
    to.rod({x, 0, in.max.z() - 0.3}, {x, in.max.y(), in.max.z() - 0.3}, 0.06);
    to.rod({x, 0, in.max.z()}, {x, middle, ridge}, 0.06);
    to.rod({x, in.max.y(), in.max.z()}, {x, middle, ridge}, 0.06);
    for (int i = 0; i < 10; ++i) {
      const double y = in.max.y() * (i + 0.5) / 10.0;
      const double high = in.max.z() + 1.2 * (1.0 - std::abs(y - middle) / middle);
      to.rod({x, y, in.max.z() - 0.3}, {x, y, high}, 0.03);
      to.rod({x, y, in.max.z() - 0.3}, {x, y + (y < middle ? 1.0 : -1.0), high + 0.03}, 0.03);
    }
    for (const double y : {0.25, in.max.y() - 0.25}) {
      to.begin("column");
      to.box({x - 0.15, y - 0.15, 0.0}, {x + 0.15, y + 0.15, in.max.z()});
    }
  }
}

Aabb build_warehouse(SceneBuilder& to, const WorldValues& values) {
  const Aabb in = box_of({0, 0, 0}, {46, 26, 9});
  add_storage_hall(to, in);
  parts::PalletRack rack;
  rack.levels = values.count("levels");
  rack.filled = values["filled"];
  rack.bays = 6;
  const double aisle = values["aisle"];
  for (double x = 12.0; x + 2.4 < 44.0; x += 2.4 + aisle) {
    for (const double beside : {0.0, 1.2}) {
      const auto placed = to.at({x + beside, 4.5, 0.0});
      parts::add_pallet_rack(to, rack);
    }
  }
  for (int i = 0; i < 3; ++i) {
    const double x = to.between(5.0, 10.0);
    const double y = 4.0 + 7.0 * i + to.between(-1.0, 1.0);
    const double turn = to.between(-kPi, kPi);
    const double lifted = to.between(0.1, 1.2);
    const auto placed = to.at({x, y, 0.0}, turn);
    parts::add_forklift(to, lifted);
  }
  for (int i = 0; i < 10; ++i) {
    const double x = to.between(1.5, 4.5);
    const double y = to.between(1.5, 24.5);
    const double tall = to.between(0.4, 1.8);
    const auto placed = to.at({x, y, 0.0}, to.between(-0.2, 0.2));
    parts::add_pallet(to, tall);
  }
  for (int i = 0; i < 4; ++i) {
    const double x = to.between(6.0, 11.0);
    const double y = to.between(2.0, 24.0);
    const auto placed = to.at({x, y, 0.0}, to.between(-kPi, kPi));
    parts::add_person(to, 1.75, i % 2 == 0);
  }
  return box_of({1, 1, 0.8}, {45, 25, 8.0});
}

}  // namespace

WorldKind warehouse() {
  return {"warehouse",
          "racks with pallets, forklifts, people, dock doors, a roof on trusses",
          {46, 26, 10},
          {{"levels", "of the racks", 3, 4, true},
           {"filled", "share of places with a load", 0.6, 0.95},
           {"aisle", "between racks, m", 3.0, 4.0}},
          build_warehouse,
          {{5, 2.5, 5.5}, {24, 16, 2.5}}};
}

}  // namespace pointflight::worlds
