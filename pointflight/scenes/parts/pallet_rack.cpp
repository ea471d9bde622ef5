#include <algorithm>

#include "pointflight/scenes/parts/site.hpp"

namespace pointflight::parts {

void add_pallet(SceneBuilder& to, double height) {
  to.begin("pallet");
  for (const double y : {-0.4, -0.05, 0.3}) to.box({-0.6, y, 0.0}, {0.6, y + 0.1, 0.1});
  for (int i = 0; i < 5; ++i) {
    const double x = -0.6 + 0.275 * i;
    to.box({x, -0.4, 0.1}, {x + 0.1, 0.4, 0.125});
  }
  to.begin("box");
  double z = 0.13;
  while (z < height - 0.15) {
    const double tall = std::min(height - z, to.between(0.25, 0.45));
    const int across = to.whole(1, 3);
    for (int i = 0; i < across; ++i) {
      for (const double y : {-0.39, 0.01}) {
        const double gap = to.between(0.0, 0.03);
        const double width = 1.18 / across;
        to.box({-0.59 + width * i + gap, y + gap, z},
               {-0.59 + width * (i + 1) - gap, y + 0.38, z + tall});
      }
    }
    z += tall;
    if (to.chance(0.15)) break;
  }
}

void add_pallet_rack(SceneBuilder& to, const PalletRack& rack) {
  const double half = 0.5 * rack.depth;
  const double height = rack.level * rack.levels + 0.3;
  to.begin("rack");
  for (int bay = 0; bay <= rack.bays; ++bay) {
    const double y = rack.bay * bay;
    for (const double x : {-half, half - 0.08})
      to.box({x, y - 0.04, 0.0}, {x + 0.08, y + 0.04, height});
    for (double z = 0.3; z + 0.9 < height; z += 0.9) {
      to.rod({-half + 0.04, y, z}, {half - 0.04, y, z + 0.9}, 0.015);
    }
  }
  for (int level = 0; level < rack.levels; ++level) {
    const double z = rack.level * level + 0.12;
    if (level == 0) continue;
    for (const double x : {-half, half - 0.05})
      to.box({x, 0.0, z - 0.12}, {x + 0.05, rack.bay * rack.bays, z});
  }
  for (int bay = 0; bay < rack.bays; ++bay) {
    for (int level = 0; level < rack.levels; ++level) {
      const double z = level == 0 ? 0.0 : rack.level * level + 0.12;
      for (const double at : {0.27, 0.73}) {
        if (!to.chance(rack.filled)) continue;
        const double off = to.between(-0.05, 0.05);
        const double tall = to.between(0.5, 0.8) * rack.level;
        const auto placed = to.at({off, rack.bay * (bay + at), z});
        add_pallet(to, tall);
      }
    }
  }
}

}  // namespace pointflight::parts
