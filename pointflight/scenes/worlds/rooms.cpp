#include "pointflight/scenes/worlds/rooms.hpp"

#include "pointflight/core/constants.hpp"
#include "pointflight/scenes/parts/furniture.hpp"

namespace pointflight::worlds {

Aabb box_of(const Vector3d& min, const Vector3d& max) {
  Aabb box;
  box.add(min);
  box.add(max);
  return box;
}

void add_slab(SceneBuilder& to, const char* name, const Aabb& box, const Aabb& hole) {
  to.begin(name);
  if (hole.empty()) {
    to.box(box.min, box.max);
    return;
  }
  const auto part = [&](double x0, double y0, double x1, double y1) {
    if (x1 - x0 > 1e-6 && y1 - y0 > 1e-6) to.box({x0, y0, box.min.z()}, {x1, y1, box.max.z()});
  };
  part(box.min.x(), box.min.y(), hole.min.x(), box.max.y());
  part(hole.max.x(), box.min.y(), box.max.x(), box.max.y());
  part(hole.min.x(), box.min.y(), hole.max.x(), hole.min.y());
  part(hole.min.x(), hole.max.y(), hole.max.x(), box.max.y());
}

void add_lamps(SceneBuilder& to, const Aabb& room, int rows, int columns) {
  for (int i = 0; i < columns; ++i) {
    for (int k = 0; k < rows; ++k) {
      to.begin("lamp");
      const double x = room.min.x() + room.size().x() * (i + 0.5) / columns;
      const double y = room.min.y() + room.size().y() * (k + 0.5) / rows;
      to.box({x - 0.6, y - 0.08, room.max.z() - 0.12}, {x + 0.6, y + 0.08, room.max.z() - 0.04});
    }
  }
}

double draw_door_angle(SceneBuilder& to) {
  const bool is_ajar = to.chance(0.15);
  const double wide = to.between(1.2, 2.0);
  const double little = to.between(0.3, 0.8);
  return is_ajar ? little : wide;
}

void add_workplace(SceneBuilder& to) {
  parts::add_desk(to);
  {
    const auto placed = to.at({0.15, to.between(-0.2, 0.2), 0.74}, kPi);
    parts::add_monitor(to);
  }
  const double away = to.between(0.45, 0.9);
  const double turn = to.between(-0.8, 0.8);
  const auto placed = to.at({-0.4 - 0.5 * away, to.between(-0.3, 0.3), 0.0}, turn);
  parts::add_swivel_chair(to);
}

}  // namespace pointflight::worlds
