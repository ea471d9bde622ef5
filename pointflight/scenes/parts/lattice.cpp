#include <algorithm>
#include <array>

#include "pointflight/scenes/parts/site.hpp"

namespace pointflight::parts {

void add_lattice(SceneBuilder& to,
                 double low,
                 double high,
                 double wide_low,
                 double wide_high,
                 int fields,
                 double bar) {
  const auto corner = [&](int side, double share) {
    const double half = 0.5 * (wide_low + share * (wide_high - wide_low));
    const std::array<Vector2d, 4> square = {
        Vector2d(-1, -1), Vector2d(1, -1), Vector2d(1, 1), Vector2d(-1, 1)};
    const Vector2d at = half * square[static_cast<std::size_t>(side % 4)];
    return Vector3d(at.x(), at.y(), low + share * (high - low));
  };
  for (int side = 0; side < 4; ++side) {
    to.rod(corner(side, 0.0), corner(side, 1.0), 1.6 * bar);
    for (int i = 0; i < fields; ++i) {
      const double from = static_cast<double>(i) / fields;
      const double until = static_cast<double>(i + 1) / fields;
      to.rod(corner(side, from), corner(side + 1, until), bar);
      to.rod(corner(side + 1, from), corner(side, until), bar);
      to.rod(corner(side, until), corner(side + 1, until), bar);
    }
  }
}

std::vector<Vector3d> add_pylon(SceneBuilder& to, double height) {
  to.begin("pylon");
  add_lattice(to, -0.5, 0.55 * height, 0.17 * height, 0.06 * height, 5, 0.03);
  add_lattice(to, 0.55 * height, height, 0.06 * height, 0.02 * height, 7, 0.02);
  std::vector<Vector3d> wires;
  constexpr double kString = 0.8;  // m: insulators
  for (const double share : {0.6, 0.74, 0.88}) {
    const double z = share * height;
    const double reach = (share < 0.7 ? 0.2 : share < 0.8 ? 0.26 : 0.16) * height;
    for (const double side : {-1.0, 1.0}) {
      const Vector3d tip(0, side * reach, z);
      for (const double x : {-0.02, 0.02}) {
        to.rod({x * height, side * 0.02 * height, z}, tip, 0.03);
        to.rod({x * height, side * 0.02 * height, z + 0.05 * height}, tip, 0.03);
      }
      const Vector3d end = tip - Vector3d(0, 0, kString);
      to.rod(tip, end, 0.02);
      for (int i = 1; i < 6; ++i) to.disc(tip - Vector3d(0, 0, kString * i / 6.0), {0, 0, 1}, 0.1);
      wires.push_back(end);
    }
  }
  wires.emplace_back(0, 0, height);
  return wires;
}

void add_wire(
    SceneBuilder& to, const Vector3d& from, const Vector3d& until, double sag, double radius) {
  to.begin("wire");
  const int pieces = std::max(8, static_cast<int>((until - from).norm() / 2.0));
  const auto at = [&](int i) {
    const double share = static_cast<double>(i) / pieces;
    return Vector3d(from + share * (until - from) -
                    Vector3d(0, 0, 4.0 * sag * share * (1.0 - share)));
  };
  for (int i = 0; i < pieces; ++i) to.rod(at(i), at(i + 1), radius);
}

void add_street_lamp(SceneBuilder& to, double height) {
  to.begin("streetlight");
  to.pole({0, 0, 0}, {0, 0, height}, 0.08, 0.05);
  to.rod({0, 0, height}, {1.2, 0, height + 0.2}, 0.03);
  to.box({1.1, -0.12, height + 0.15}, {1.7, 0.12, height + 0.28});
}

void add_tower_crane(SceneBuilder& to, double height, double jib) {
  to.begin("crane");
  to.box({-2.0, -2.0, 0.0}, {2.0, 2.0, 0.6});
  add_lattice(to, 0.6, height, 1.6, 1.6, static_cast<int>(height / 1.6), 0.03);
  to.box({0.8, -0.8, height - 1.5}, {2.2, 0.6, height + 0.3});
  add_lattice(to, height, height + 5.0, 1.6, 0.2, 3, 0.03);
  // the jib: three chords and diagonals
  const auto chords = [&](double from, double until) {
    const double step = from < until ? 1.5 : -1.5;
    for (const double y : {-0.6, 0.6}) to.rod({from, y, height}, {until, y, height}, 0.04);
    to.rod({from, 0, height + 1.1}, {until, 0, height + 1.1}, 0.04);
    for (double x = from; step > 0 ? x + step <= until : x + step >= until; x += step) {
      for (const double y : {-0.6, 0.6}) {
        to.rod({x, y, height}, {x + 0.5 * step, 0, height + 1.1}, 0.025);
        to.rod({x + 0.5 * step, 0, height + 1.1}, {x + step, y, height}, 0.025);
      }
      to.rod({x, -0.6, height}, {x + step, 0.6, height}, 0.02);
    }
  };
  chords(0.8, jib);
  chords(-0.8, -0.35 * jib);
  to.rod({0, 0, height + 5.0}, {0.7 * jib, 0, height + 1.1}, 0.02);
  to.rod({0, 0, height + 5.0}, {-0.33 * jib, 0, height + 1.1}, 0.02);
  to.box({-0.35 * jib, -0.8, height - 1.6}, {-0.28 * jib, 0.8, height + 0.2});
  const double hook = 0.55 * jib;
  to.box({hook - 0.5, -0.5, height - 0.4}, {hook + 0.5, 0.5, height - 0.1});
  to.rod({hook, 0, height - 0.4}, {hook, 0, 0.45 * height}, 0.015);
  to.box({hook - 0.2, -0.15, 0.45 * height - 0.5}, {hook + 0.2, 0.15, 0.45 * height});
}

void add_girder(SceneBuilder& to, const Vector3d& from, const Vector3d& until, double height) {
  to.begin("girder");
  const Vector3d along = until - from;
  const Vector3d across = Vector3d(-along.y(), along.x(), 0.0).normalized();
  const double wide = 0.4 * height;
  const Vector3d up(0, 0, height);
  to.rectangle(from, along, up);
  for (const double share : {0.0, 1.0}) {
    to.rectangle(from + share * up - 0.5 * wide * across, along, wide * across);
  }
}

}  // namespace pointflight::parts
