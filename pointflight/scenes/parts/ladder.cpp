#include "pointflight/scenes/parts/furniture.hpp"

namespace pointflight::parts {

void add_ladder(SceneBuilder& to, double height, double lean) {
  constexpr double kHalf = 0.22;  // m
  to.begin("ladder");
  const Vector3d top(lean, 0, height);
  for (const double y : {-kHalf, kHalf}) to.rod({0, y, 0}, top + Vector3d(0, y, 0), 0.02);
  for (double at = 0.3; at < height - 0.1; at += 0.28) {
    const Vector3d middle = at / height * top;
    to.rod(middle - Vector3d(0, kHalf, 0), middle + Vector3d(0, kHalf, 0), 0.014);
  }
}

}  // namespace pointflight::parts
