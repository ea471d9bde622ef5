#include <cmath>

#include "pointflight/core/math.hpp"
#include "pointflight/scenes/parts/building.hpp"

namespace pointflight::parts {
namespace {

double length_of(const Wall& wall) {
  return (wall.to - wall.from).norm();
}

/// The wall's frame: x along it, y across, from its foot.
Pose frame_of(const Wall& wall) {
  const Vector2d along = (wall.to - wall.from) / length_of(wall);
  Matrix3d axes = Matrix3d::Identity();
  axes.col(0) = Vector3d(along.x(), along.y(), 0.0);
  axes.col(1) = Vector3d(-along.y(), along.x(), 0.0);
  return {Quaterniond(axes), {wall.from.x(), wall.from.y(), wall.bottom}};
}

void add_window(SceneBuilder& to, const Opening& o) {
  constexpr double kFrame = 0.03;  // m, half
  to.begin("window frame");
  const auto bar = [&](double from, double until, double low, double high) {
    to.box({from, -kFrame, low}, {until, kFrame, high});
  };
  bar(o.from, o.to, o.bottom, o.bottom + 2 * kFrame);
  bar(o.from, o.to, o.top - 2 * kFrame, o.top);
  const int panes = std::max(1, static_cast<int>(std::lround((o.to - o.from) / o.pane)));
  for (int i = 0; i <= panes; ++i) {
    const double at = o.from + (o.to - o.from) * i / panes;
    const double low = std::max(o.from, at - kFrame);
    bar(low, std::min(o.to, low + 2 * kFrame), o.bottom + 2 * kFrame, o.top - 2 * kFrame);
  }
  to.begin("glass");
  to.rectangle({o.from, 0, o.bottom}, {o.to - o.from, 0, 0}, {0, 0, o.top - o.bottom});
}

}  // namespace

void add_wall(SceneBuilder& to, const Wall& wall) {
  const auto placed = to.at(frame_of(wall));
  const double half = 0.5 * wall.thickness;
  const double height = wall.top - wall.bottom;
  to.begin("wall");
  const auto block = [&](double from, double until, double low, double high) {
    if (until - from > 1e-6 && high - low > 1e-6) to.box({from, -half, low}, {until, half, high});
  };
  double at = 0.0;
  for (const Opening& o : wall.openings) {
    block(at, o.from, 0.0, height);
    block(o.from, o.to, 0.0, o.bottom);
    block(o.from, o.to, o.top, height);
    at = o.to;
  }
  block(at, length_of(wall), 0.0, height);
  for (const Opening& o : wall.openings) {
    if (o.has_glass) add_window(to, o);
  }
}

void add_door(SceneBuilder& to, const Wall& wall, const Opening& opening, double angle) {
  const auto in_wall = to.at(frame_of(wall));
  const auto hinge = to.at({opening.from, 0.0, 0.0}, angle);
  const double width = opening.to - opening.from;
  to.begin("door");
  to.box({0.01, -0.02, opening.bottom + 0.01}, {width - 0.01, 0.02, opening.top - 0.01});
  to.rod({width - 0.08, -0.07, 1.05}, {width - 0.08, 0.07, 1.05}, 0.012);
}

}  // namespace pointflight::parts
