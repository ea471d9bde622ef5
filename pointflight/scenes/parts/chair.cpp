#include "pointflight/core/constants.hpp"
#include "pointflight/core/math.hpp"
#include "pointflight/scenes/parts/furniture.hpp"

namespace pointflight::parts {
namespace {

constexpr double kSeat = 0.45;  // m

void add_seat(SceneBuilder& to) {
  to.box({-0.22, -0.23, kSeat - 0.05}, {0.24, 0.23, kSeat});
}

}  // namespace

void add_chair(SceneBuilder& to) {
  to.begin("chair");
  for (const double y : {-0.21, 0.18}) {
    to.box({0.2, y, 0.0}, {0.23, y + 0.03, kSeat - 0.05});
    to.box({-0.22, y, 0.0}, {-0.19, y + 0.03, kSeat - 0.05});
    to.box({-0.22, y, kSeat}, {-0.19, y + 0.03, 0.9});
  }
  add_seat(to);
  to.box({-0.21, -0.21, 0.62}, {-0.19, 0.21, 0.88});
}

void add_swivel_chair(SceneBuilder& to) {
  to.begin("swivel chair");
  for (int i = 0; i < 5; ++i) {
    const auto heading = math::sincos(2.0 * kPi / 5.0 * i);
    const Vector3d out(0.3 * heading.cos, 0.3 * heading.sin, 0.06);
    to.rod({0, 0, 0.1}, out, 0.02);
    to.ball(out - Vector3d(0, 0, 0.03), 0.03);
  }
  to.pole({0, 0, 0.08}, {0, 0, kSeat - 0.05}, 0.03);
  add_seat(to);
  to.box({-0.26, -0.03, 0.3}, {-0.23, 0.03, 0.6});
  to.box({-0.26, -0.22, 0.55}, {-0.21, 0.22, 1.05});
  for (const double y : {-0.28, 0.24}) to.box({-0.15, y, 0.62}, {0.12, y + 0.04, 0.65});
}

}  // namespace pointflight::parts
