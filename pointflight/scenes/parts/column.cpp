#include "pointflight/scenes/parts/building.hpp"

namespace pointflight::parts {

void add_column(SceneBuilder& to, double radius, double height) {
  to.begin("column");
  const double wide = 1.5 * radius;
  const double plinth = 0.6 * radius;
  const double capital = 1.4 * radius;
  to.box({-wide, -wide, 0.0}, {wide, wide, plinth});
  to.pole({0, 0, plinth}, {0, 0, plinth + 0.3 * radius}, 1.3 * radius);
  to.pole({0, 0, plinth + 0.3 * radius}, {0, 0, height - capital}, radius, 0.85 * radius);
  to.pole({0, 0, height - capital}, {0, 0, height - 0.4 * radius}, 0.9 * radius, 1.4 * radius);
  to.box({-wide, -wide, height - 0.4 * radius}, {wide, wide, height});
}

}  // namespace pointflight::parts
