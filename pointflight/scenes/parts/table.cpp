#include "pointflight/scenes/parts/furniture.hpp"

namespace pointflight::parts {
namespace {

constexpr double kLeg = 0.05;  // m
constexpr double kTop = 0.03;

void add_legs(SceneBuilder& to, double length, double width, double height) {
  for (const double x : {-0.5 * width, 0.5 * width - kLeg}) {
    for (const double y : {-0.5 * length, 0.5 * length - kLeg}) {
      to.box({x, y, 0.0}, {x + kLeg, y + kLeg, height});
    }
  }
}

}  // namespace

void add_table(SceneBuilder& to, double length, double width, double height) {
  to.begin("table");
  add_legs(to, length, width, height - kTop);
  to.box({-0.5 * width, -0.5 * length, height - kTop}, {0.5 * width, 0.5 * length, height});
}

void add_desk(SceneBuilder& to, double length, double width) {
  constexpr double kHeight = 0.74;
  to.begin("desk");
  add_legs(to, length, width, kHeight - kTop);
  to.box({-0.5 * width, -0.5 * length, kHeight - kTop}, {0.5 * width, 0.5 * length, kHeight});
  to.box({-0.5 * width + 0.1, -0.5 * length + kLeg, 0.3},
         {-0.5 * width + 0.12, 0.5 * length - kLeg, kHeight - kTop});
  to.box({-0.5 * width + 0.14, 0.5 * length - 0.5, 0.08},
         {0.5 * width - 0.05, 0.5 * length - kLeg - 0.01, kHeight - kTop - 0.01});
}

}  // namespace pointflight::parts
