#include <algorithm>

#include "pointflight/scenes/parts/furniture.hpp"

namespace pointflight::parts {
namespace {

constexpr double kBoard = 0.02;  // m

/// Books and boxes on a board, from one end to the other.
void add_goods(SceneBuilder& to, double length, double depth, double z, double room) {
  double y = -0.5 * length + 0.03;
  while (y < 0.5 * length - 0.1) {
    const double width = to.between(0.03, 0.3);
    const double deep = to.between(0.5, 0.95) * depth;
    const double high = to.between(0.35, 0.9) * room;
    const double end = std::min(y + width, 0.5 * length - 0.03);
    to.box({0.5 * depth - deep, y, z}, {0.5 * depth - 0.01, end, z + high});
    y = end + to.between(0.005, 0.15);
  }
}

}  // namespace

void add_shelf(SceneBuilder& to, double length, double depth, double height, int boards) {
  to.begin("shelf");
  for (const double y : {-0.5 * length, 0.5 * length - kBoard}) {
    to.box({-0.5 * depth, y, 0.0}, {0.5 * depth, y + kBoard, height});
  }
  const double step = (height - 0.1) / boards;
  for (int i = 0; i <= boards; ++i) {
    const double z = 0.08 + step * i;
    to.box({-0.5 * depth, -0.5 * length + kBoard, z},
           {0.5 * depth, 0.5 * length - kBoard, z + kBoard});
    if (i < boards) add_goods(to, length, depth, z + kBoard, step - kBoard);
  }
}

void add_cabinet(SceneBuilder& to, double length, double depth, double height) {
  to.begin("cabinet");
  to.box({-0.5 * depth, -0.5 * length, 0.0}, {0.5 * depth, 0.5 * length, height});
  const int doors = std::max(1, static_cast<int>(length / 0.5));
  for (int i = 0; i < doors; ++i) {
    const double y = -0.5 * length + length / doors * (i + 0.85);
    to.pole({0.5 * depth + 0.02, y, 0.45 * height}, {0.5 * depth + 0.02, y, 0.6 * height}, 0.01);
  }
}

}  // namespace pointflight::parts
