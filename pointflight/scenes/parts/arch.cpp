#include <algorithm>
#include <cmath>

#include "pointflight/core/constants.hpp"
#include "pointflight/core/math.hpp"
#include "pointflight/scenes/parts/building.hpp"

namespace pointflight::parts {
namespace {

constexpr int kSegments = 16;  // of a half circle

}  // namespace

void add_arch(SceneBuilder& to, double half, double spring, double top, double thickness) {
  to.begin("arch");
  const double side = 0.5 * thickness;
  const auto on_arch = [&](int i) {
    const auto angle = math::sincos(kPi * i / kSegments);
    return Vector2d(-half * angle.cos, spring + half * angle.sin);
  };
  for (int i = 0; i < kSegments; ++i) {
    const Vector2d a = on_arch(i);
    const Vector2d b = on_arch(i + 1);
    for (const double x : {-side, side}) {
      to.triangle({x, a.x(), a.y()}, {x, b.x(), b.y()}, {x, b.x(), top});
      to.triangle({x, a.x(), a.y()}, {x, b.x(), top}, {x, a.x(), top});
    }
    const Vector3d along(0, b.x() - a.x(), b.y() - a.y());
    to.rectangle({-side, a.x(), a.y()}, along, {thickness, 0, 0});
  }
  to.rectangle({-side, -half, top}, {0, 2 * half, 0}, {thickness, 0, 0});
  // the ends between springing and top, so that it is closed
  for (const double y : {-half, half}) {
    to.rectangle({-side, y, spring}, {thickness, 0, 0}, {0, 0, top - spring});
  }
}

void add_groin_vault(SceneBuilder& to, double half, double rise) {
  to.begin("vault");
  const auto barrel = [&](double across) {
    const double share = std::min(1.0, std::abs(across) / half);
    return rise * std::sqrt(std::max(0.0, 1.0 - share * share));
  };
  to.relief({-half, -half}, {half, half}, half / 12.0, [&](double x, double y) {
    return std::max(barrel(x), barrel(y));
  });
}

}  // namespace pointflight::parts
