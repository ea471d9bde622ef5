#include "pointflight/scenes/parts/furniture.hpp"

namespace pointflight::parts {

void add_monitor(SceneBuilder& to, double width) {
  to.begin("monitor");
  to.box({-0.1, -0.12, 0.0}, {0.1, 0.12, 0.015});
  to.pole({-0.03, 0, 0.015}, {-0.03, 0, 0.25}, 0.02);
  to.box({-0.01, -0.5 * width, 0.12}, {0.02, 0.5 * width, 0.12 + 0.6 * width});
}

}  // namespace pointflight::parts
