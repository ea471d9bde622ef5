#include "pointflight/scenes/parts/furniture.hpp"

namespace pointflight::parts {

void add_sofa(SceneBuilder& to, double length) {
  to.begin("sofa");
  to.box({-0.45, -0.5 * length, 0.08}, {0.45, 0.5 * length, 0.42});
  to.box({-0.45, -0.5 * length, 0.42}, {-0.2, 0.5 * length, 0.85});
  for (const double y : {-0.5 * length, 0.5 * length - 0.18}) {
    to.box({-0.2, y, 0.42}, {0.45, y + 0.18, 0.62});
  }
  for (const double y : {-0.3 * length, 0.05 * length}) {
    to.box({-0.19, y, 0.43}, {-0.05, y + 0.25 * length, 0.78});
  }
}

void add_bed(SceneBuilder& to, double length, double width) {
  to.begin("bed");
  to.box({-0.5 * length, -0.5 * width, 0.1}, {0.5 * length, 0.5 * width, 0.3});
  to.box({-0.5 * length + 0.05, -0.5 * width + 0.03, 0.3},
         {0.5 * length - 0.03, 0.5 * width - 0.03, 0.52});
  to.box({-0.5 * length, -0.5 * width, 0.3}, {-0.5 * length + 0.04, 0.5 * width, 1.0});
  for (const double y : {-0.42 * width, 0.07 * width}) {
    to.box({-0.5 * length + 0.1, y, 0.52}, {-0.5 * length + 0.5, y + 0.35 * width, 0.64});
  }
}

}  // namespace pointflight::parts
