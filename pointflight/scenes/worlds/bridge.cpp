#include <algorithm>
#include <cmath>

#include "pointflight/core/constants.hpp"
#include "pointflight/core/math.hpp"
#include "pointflight/scenes/parts/building.hpp"
#include "pointflight/scenes/parts/plants.hpp"
#include "pointflight/scenes/parts/site.hpp"
#include "pointflight/scenes/parts/traffic.hpp"
#include "pointflight/scenes/worlds/rooms.hpp"
#include "pointflight/scenes/worlds/worlds.hpp"

namespace pointflight::worlds {
namespace {

constexpr double kBridgeLong = 100.0;  // m
constexpr double kBridgeWide = 40.0;
constexpr double kDeck = 12.0;  // above the water

/// Banks at both ends, a bed between them.
double valley(double x, double y) {
  const double from_middle = std::abs(x - 0.5 * kBridgeLong) / (0.5 * kBridgeLong);
  const double bank = std::clamp((from_middle - 0.55) / 0.35, 0.0, 1.0);
  const double smooth = bank * bank * (3.0 - 2.0 * bank);
  return -1.5 + smooth * (kDeck - 0.5 + 1.5) +
         0.2 * math::sin(0.5 * x + 0.2 * y) * math::cos(0.4 * y);
}

constexpr double kDeckLow = 0.5 * kBridgeWide - 4.0;  // its edges in y
constexpr double kDeckHigh = 0.5 * kBridgeWide + 4.0;
constexpr double kTowerAt = 24.0;  // from either end

/// The deck, girders and bracing below it.
void add_deck(SceneBuilder& to) {
  add_slab(to, "road", box_of({0, kDeckLow, kDeck - 0.25}, {kBridgeLong, kDeckHigh, kDeck}));
  for (const double y : {kDeckLow + 0.4, kDeckHigh - 0.4}) {
    parts::add_girder(to, {5.0, y, kDeck - 1.9}, {kBridgeLong - 5.0, y, kDeck - 1.9}, 1.6);
  }
  for (double x = 8.0; x < kBridgeLong - 7.0; x += 4.0) {
    parts::add_girder(to, {x, kDeckLow + 0.4, kDeck - 1.1}, {x, kDeckHigh - 0.4, kDeck - 1.1}, 0.8);
    to.begin("girder");
    to.rod({x, kDeckLow + 0.4, kDeck - 1.8}, {x + 4.0, kDeckHigh - 0.4, kDeck - 1.8}, 0.06);
    to.rod({x, kDeckHigh - 0.4, kDeck - 1.8}, {x + 4.0, kDeckLow + 0.4, kDeck - 1.8}, 0.06);
  }
}

/// Towers, main cables as parabolas, hangers, railings.
void add_suspension(SceneBuilder& to, double tower, double hangers) {
  const double x0 = kTowerAt;
  const double x1 = kBridgeLong - kTowerAt;
  for (const double x : {x0, x1}) {
    to.begin("column");
    for (const double y : {kDeckLow - 0.6, kDeckHigh + 0.6}) {
      to.box({x - 0.7, y - 0.6, -2.0}, {x + 0.7, y + 0.6, kDeck + tower});
    }
    for (const double z : {kDeck - 2.6, kDeck + 0.55 * tower, kDeck + tower - 0.8}) {
      to.box({x - 0.5, kDeckLow, z}, {x + 0.5, kDeckHigh, z + 0.8});
    }
    to.box({x - 2.0, kDeckLow - 2.0, -2.0}, {x + 2.0, kDeckHigh + 2.0, 1.0});
  }
  for (const double y : {kDeckLow - 0.2, kDeckHigh + 0.2}) {
    const double span = x1 - x0;
    const auto cable = [&](double x) {
      const double share = (x - x0) / span;
      return kDeck + 1.2 + (tower - 1.2) * (1.0 - 4.0 * share * (1.0 - share));
    };
    to.begin("cable");
    constexpr int kPieces = 40;
    for (int i = 0; i < kPieces; ++i) {
      const double a = x0 + span * i / kPieces;
      const double b = x0 + span * (i + 1) / kPieces;
      to.rod({a, y, cable(a)}, {b, y, cable(b)}, 0.12);
    }
    to.rod({x0, y, kDeck + tower}, {2.0, y, kDeck}, 0.12);
    to.rod({x1, y, kDeck + tower}, {kBridgeLong - 2.0, y, kDeck}, 0.12);
    for (double x = x0 + hangers; x < x1 - 0.5; x += hangers) {
      to.rod({x, y, kDeck}, {x, y, cable(x)}, 0.02);
    }
    parts::add_railing(to, {0.5, y, kDeck}, {kBridgeLong - 0.5, y, kDeck}, 1.1);
  }
}

/// Cars on the deck, trees on the banks, rocks in the bed.
void add_bridge_things(SceneBuilder& to) {
  const double middle = 0.5 * kBridgeWide;
  for (int i = 0; i < 4; ++i) {
    const double x = to.between(8.0, 92.0);
    const bool is_there = to.chance(0.5);
    const int body = to.whole(0, 2);
    const auto placed = to.at({x, middle + (is_there ? 1.9 : -1.9), kDeck}, is_there ? kPi : 0.0);
    parts::add_car(to, static_cast<parts::CarBody>(body));
  }
  for (int i = 0; i < 26; ++i) {
    const double along = to.between(1.0, 15.0);
    const double x = to.chance(0.5) ? along : kBridgeLong - along;
    const double beside = to.between(7.0, 18.5);
    const double y = middle + (to.chance(0.5) ? beside : -beside);
    parts::Tree tree;
    tree.height = to.between(4.0, 9.0);
    tree.trunk = 0.15;
    tree.crown = 0.24 * tree.height;
    tree.leaves = 600;
    const auto placed = to.at({x, y, valley(x, y)});
    parts::add_broadleaf(to, tree);
  }
  for (int i = 0; i < 30; ++i) {
    const double x = to.between(15.0, 85.0);
    const double y = to.between(1.0, kBridgeWide - 1.0);
    const auto placed = to.at({x, y, valley(x, y)});
    parts::add_rock(to, to.between(0.3, 1.0));
  }
}

/// A suspension bridge over a river.
Aabb build_bridge(SceneBuilder& to, const WorldValues& values) {
  to.begin("ground");
  to.relief({0, 0}, {kBridgeLong, kBridgeWide}, 0.6, valley);
  to.begin("water");
  to.rectangle({12, 0, 0}, {kBridgeLong - 24, 0, 0}, {0, kBridgeWide, 0});
  add_deck(to);
  add_suspension(to, values["tower"], values["hangers"]);
  add_bridge_things(to);
  return box_of({6, 2, 2.0}, {kBridgeLong - 6, kBridgeWide - 2, 18.0});
}

}  // namespace

WorldKind bridge() {
  return {"bridge",
          "a suspension bridge: towers, cables, hangers, girders under the deck, a river",
          {100, 40, 30},
          {{"tower", "above the deck, m", 10.0, 16.0}, {"hangers", "apart, m", 2.0, 4.0}},
          build_bridge,
          {{18, 3, 7}, {55, 20, 12}}};
}

}  // namespace pointflight::worlds
