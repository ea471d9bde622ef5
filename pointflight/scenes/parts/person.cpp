#include "pointflight/scenes/parts/traffic.hpp"

namespace pointflight::parts {

void add_person(SceneBuilder& to, double height, bool walks) {
  to.begin("person");
  const double h = height / 1.75;
  const double stride = walks ? 0.28 * h : 0.0;
  for (const double side : {-1.0, 1.0}) {
    const Vector3d hip(0.0, 0.1 * side * h, 0.88 * h);
    const Vector3d foot(side * stride, 0.1 * side * h, 0.05 * h);
    to.pole(foot, hip, 0.055 * h, 0.085 * h);
    to.box(foot + Vector3d(-0.08, -0.045, -0.05) * h, foot + Vector3d(0.17, 0.045, 0.03) * h);
    const Vector3d shoulder(0.0, 0.21 * side * h, 1.42 * h);
    const Vector3d hand(-side * 0.8 * stride, 0.27 * side * h, 0.82 * h);
    to.pole(hand, shoulder, 0.035 * h, 0.05 * h);
  }
  to.pole({0, 0, 0.85 * h}, {0, 0, 1.48 * h}, 0.14 * h, 0.19 * h);
  to.pole({0, 0, 1.48 * h}, {0, 0, 1.56 * h}, 0.055 * h);
  to.ball({0, 0, 1.64 * h}, 0.11 * h);
}

}  // namespace pointflight::parts
