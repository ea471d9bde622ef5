#include <algorithm>
#include <cmath>

#include "pointflight/scenes/parts/building.hpp"

namespace pointflight::parts {

void add_balustrade(SceneBuilder& to, double length, double height) {
  to.begin("balustrade");
  constexpr double kPlinth = 0.1;  // m
  constexpr double kRail = 0.12;
  to.box({-0.12, 0.0, 0.0}, {0.12, length, kPlinth});
  to.box({-0.12, 0.0, height - kRail}, {0.12, length, height});
  const int count = std::max(1, static_cast<int>(length / 0.25));
  const double tall = height - kRail - kPlinth;
  for (int i = 0; i < count; ++i) {
    const double y = length * (i + 0.5) / count;
    const auto ring = [&](double share) { return Vector3d(0, y, kPlinth + share * tall); };
    to.taper(ring(0.0), ring(0.35), 0.05, 0.08);
    to.taper(ring(0.35), ring(0.75), 0.08, 0.035);
    to.taper(ring(0.75), ring(1.0), 0.035, 0.05);
  }
}

void add_railing(SceneBuilder& to, const Vector3d& from, const Vector3d& until, double height) {
  to.begin("railing");
  const Vector3d along = until - from;
  const double length = along.norm();
  const int fields = std::max(1, static_cast<int>(std::lround(length / 1.5)));
  const Vector3d up(0, 0, 1);
  for (int i = 0; i <= fields; ++i) {
    const Vector3d foot = from + along * (static_cast<double>(i) / fields);
    to.rod(foot, foot + height * up, 0.02);
  }
  to.rod(from + height * up, until + height * up, 0.022);
  for (const double share : {0.35, 0.7}) {
    to.rod(from + share * height * up, until + share * height * up, 0.012);
  }
}

void add_pipe(SceneBuilder& to, const std::vector<Vector3d>& corners, double radius) {
  to.begin("pipe");
  for (std::size_t i = 0; i + 1 < corners.size(); ++i) {
    to.pole(corners[i], corners[i + 1], radius);
    if (i > 0) to.ball(corners[i], 1.05 * radius);
  }
}

}  // namespace pointflight::parts
