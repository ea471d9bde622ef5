#include <algorithm>
#include <cmath>

#include "pointflight/scenes/parts/building.hpp"

namespace pointflight::parts {

void add_stairs(SceneBuilder& to, double width, double height, double going) {
  to.begin("stairs");
  const int steps = std::max(1, static_cast<int>(std::lround(height / 0.175)));
  const double rise = height / steps;
  for (int i = 0; i < steps; ++i) {
    to.box({going * i, -0.5 * width, 0.0}, {going * (i + 1), 0.5 * width, rise * (i + 1)});
  }
}

}  // namespace pointflight::parts
