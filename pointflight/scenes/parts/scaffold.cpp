#include "pointflight/scenes/parts/site.hpp"

namespace pointflight::parts {

void add_scaffold(SceneBuilder& to, int bays, int lifts) {
  constexpr double kBay = 2.5;  // m
  constexpr double kLift = 2.0;
  constexpr double kDeep = 1.0;
  constexpr double kTube = 0.024;
  to.begin("scaffold");
  const double length = kBay * bays;
  const double height = kLift * lifts + 1.0;
  for (int i = 0; i <= bays; ++i) {
    for (const double x : {0.0, kDeep}) to.rod({x, kBay * i, 0.0}, {x, kBay * i, height}, kTube);
    for (int k = 1; k <= lifts; ++k)
      to.rod({0, kBay * i, kLift * k}, {kDeep, kBay * i, kLift * k}, kTube);
  }
  for (int k = 1; k <= lifts; ++k) {
    const double z = kLift * k;
    to.box({0.05, 0.05, z}, {kDeep - 0.05, length - 0.05, z + 0.04});
    for (const double up : {0.5, 1.0}) to.rod({kDeep, 0, z + up}, {kDeep, length, z + up}, kTube);
    to.rod({0, 0, z}, {0, length, z}, kTube);
  }
  for (int i = 0; i < bays; ++i) {
    const int k = i % lifts;
    to.rod({kDeep, kBay * i, kLift * k}, {kDeep, kBay * (i + 1), kLift * (k + 1)}, kTube);
  }
}

}  // namespace pointflight::parts
