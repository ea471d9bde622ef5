#include <vector>

#include "pointflight/scenes/parts/traffic.hpp"

namespace pointflight::parts {
namespace {

void add_wheel(SceneBuilder& to, double x, double y, double radius, double width) {
  to.pole({x, y - 0.5 * width, radius}, {x, y + 0.5 * width, radius}, radius);
}

void add_wheels(
    SceneBuilder& to, double front, double rear, double track, double radius, double width) {
  for (const double x : {front, rear}) {
    for (const double y : {-0.5 * track, 0.5 * track}) add_wheel(to, x, y, radius, width);
  }
}

}  // namespace

void add_car(SceneBuilder& to, CarBody body) {
  to.begin("car");
  // lower bodies, then what stands on them; the first corner sees all others
  if (body == CarBody::kVan) {
    to.profile(
        {{0.0, 0.3}, {2.4, 0.3}, {2.45, 0.9}, {1.9, 1.05}, {1.2, 1.95}, {-2.4, 1.95}, {-2.45, 0.3}},
        -0.92,
        0.92);
    add_wheels(to, 1.55, -1.6, 1.62, 0.33, 0.22);
    for (const double y : {-1.02, 0.92}) to.box({1.25, y, 1.05}, {1.35, y + 0.1, 1.3});
    return;
  }
  to.profile({{0.0, 0.28},
              {2.15, 0.28},
              {2.2, 0.6},
              {2.05, 0.78},
              {-2.15, 0.88},
              {-2.2, 0.45},
              {-2.1, 0.28}},
             -0.88,
             0.88);
  if (body == CarBody::kSedan) {
    to.profile({{-0.2, 0.8}, {1.05, 0.8}, {0.35, 1.4}, {-1.0, 1.42}, {-1.75, 0.86}}, -0.74, 0.74);
  } else {
    to.profile({{-0.2, 0.8}, {1.05, 0.8}, {0.35, 1.45}, {-1.7, 1.48}, {-2.1, 0.88}}, -0.75, 0.75);
  }
  add_wheels(to, 1.35, -1.3, 1.58, 0.31, 0.2);
  for (const double y : {-1.0, 0.88}) to.box({0.7, y, 0.85}, {0.8, y + 0.12, 0.98});
}

void add_truck(SceneBuilder& to) {
  to.begin("truck");
  to.profile(
      {{3.0, 0.5}, {4.6, 0.5}, {4.6, 1.5}, {4.35, 2.6}, {2.9, 2.7}, {2.9, 0.5}}, -1.15, 1.15);
  to.box({-3.6, -1.2, 1.0}, {2.7, 1.2, 3.4});
  to.box({-3.5, -0.45, 0.6}, {3.2, 0.45, 1.0});
  add_wheels(to, 3.6, -2.2, 2.0, 0.48, 0.28);
  for (const double y : {-1.0, 1.0}) add_wheel(to, -3.1, y, 0.48, 0.28);
}

void add_forklift(SceneBuilder& to, double lifted) {
  to.begin("forklift");
  to.box({-1.1, -0.55, 0.25}, {0.7, 0.55, 0.8});
  to.box({-1.2, -0.55, 0.8}, {-0.5, 0.55, 1.15});
  to.box({-0.45, -0.25, 0.8}, {0.0, 0.25, 1.0});
  to.box({-0.5, -0.25, 1.0}, {-0.42, 0.25, 1.5});
  for (const double y : {-0.5, 0.46}) {
    to.box({-0.6, y, 1.15}, {-0.56, y + 0.04, 2.1});
    to.box({0.5, y, 0.8}, {0.54, y + 0.04, 2.1});
  }
  to.box({-0.62, -0.52, 2.1}, {0.58, 0.52, 2.14});
  for (const double y : {-0.4, 0.32}) to.box({0.75, y, 0.1}, {0.85, y + 0.08, 2.4});
  to.box({0.87, -0.45, lifted + 0.05}, {0.9, 0.45, lifted + 0.55});
  for (const double y : {-0.3, 0.18}) to.box({0.9, y, lifted}, {2.0, y + 0.12, lifted + 0.05});
  add_wheels(to, 0.4, -0.8, 1.0, 0.28, 0.2);
}

}  // namespace pointflight::parts
