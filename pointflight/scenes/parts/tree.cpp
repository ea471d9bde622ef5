#include <algorithm>
#include <cmath>

#include "pointflight/core/constants.hpp"
#include "pointflight/core/math.hpp"
#include "pointflight/scenes/parts/plants.hpp"

namespace pointflight::parts {
namespace {

Vector3d drawn_direction(SceneBuilder& to) {
  const double azimuth = to.between(-kPi, kPi);
  const double z = to.between(-1.0, 1.0);
  const auto heading = math::sincos(azimuth);
  const double across = std::sqrt(1.0 - z * z);
  return {across * heading.cos, across * heading.sin, z};
}

void add_leaf(SceneBuilder& to, const Vector3d& around, double spread, double largest) {
  const Vector3d way = drawn_direction(to);
  const double far = to.between(0.1, 1.0);
  Vector3d normal = drawn_direction(to);
  normal.z() = std::abs(normal.z()) + 0.4;  // leaves lie more than they stand
  const double radius = to.between(0.5, 1.0) * largest;
  to.disc(around + far * spread * way, normal, radius);
}

}  // namespace

void add_broadleaf(SceneBuilder& to, const Tree& tree) {
  to.begin("tree");
  const double fork = tree.crown_from * tree.height;
  const double lean_x = to.between(-0.04, 0.04);
  const double lean_y = to.between(-0.04, 0.04);
  const auto on_trunk = [&](double z) { return Vector3d(lean_x * z, lean_y * z, z); };
  to.taper(on_trunk(-0.3), on_trunk(fork), tree.trunk, 0.7 * tree.trunk);
  to.taper(on_trunk(fork), on_trunk(0.92 * tree.height), 0.7 * tree.trunk, 0.15 * tree.trunk);
  const int branches = to.whole(9, 14);
  const int twigs = 3;
  const int leaves = std::max(1, tree.leaves / (branches * twigs));
  for (int i = 0; i < branches; ++i) {
    const double share = (i + to.between(0.0, 1.0)) / branches;
    const double z = fork + share * (0.9 * tree.height - fork);
    // the crown is widest at a third of its height
    const double wide =
        tree.crown * std::sqrt(std::max(0.1, 1.0 - (share - 0.33) * (share - 0.33) * 1.8));
    const auto heading = math::sincos(2.4 * i + to.between(-0.4, 0.4));
    const double reach = to.between(0.6, 1.0) * wide;
    const double rise = to.between(0.2, 0.6) * reach;
    const Vector3d from = on_trunk(z);
    const Vector3d tip = from + Vector3d(reach * heading.cos, reach * heading.sin, rise);
    const double thick = tree.trunk * (0.45 - 0.3 * share);
    to.taper(from, tip, thick, 0.3 * thick);
    for (int k = 0; k < twigs; ++k) {
      const double at = to.between(0.45, 1.0);
      const Vector3d foot = from + at * (tip - from);
      Vector3d way = drawn_direction(to);
      way.z() = std::abs(way.z());
      const double length = to.between(0.2, 0.45) * tree.crown;
      const Vector3d end = foot + length * way;
      to.taper(foot, end, 0.35 * thick, 0.1 * thick);
      to.part("leaves");
      for (int n = 0; n < leaves; ++n) add_leaf(to, end, 0.4 * tree.crown, tree.leaf);
      to.part("tree");
    }
  }
}

void add_conifer(SceneBuilder& to, const Tree& tree) {
  to.begin("tree");
  to.taper({0, 0, -0.3}, {0, 0, tree.height}, tree.trunk, 0.05 * tree.trunk);
  const double from = tree.crown_from * tree.height;
  const int whorls = std::max(3, static_cast<int>((tree.height - from) / 0.55));
  const int leaves = std::max(1, tree.leaves / (whorls * 6));
  for (int w = 0; w < whorls; ++w) {
    const double share = (w + 0.5) / whorls;
    const double z = from + share * (tree.height - from);
    const double reach = tree.crown * (1.0 - 0.92 * share);
    const int branches = to.whole(5, 7);
    const double turn = to.between(0.0, 2.0 * kPi);
    for (int i = 0; i < branches; ++i) {
      const auto heading = math::sincos(turn + 2.0 * kPi * i / branches);
      const double length = to.between(0.75, 1.05) * reach;
      const Vector3d foot(0, 0, z);
      const Vector3d tip =
          foot + Vector3d(length * heading.cos, length * heading.sin, -0.18 * length);
      const double thick = std::max(0.006, 0.18 * tree.trunk * (1.0 - share));
      to.taper(foot, tip, thick, 0.3 * thick);
      to.part("leaves");
      for (int n = 0; n < leaves; ++n) {
        const double at = to.between(0.25, 1.0);
        add_leaf(to, foot + at * (tip - foot), 0.22, 0.7 * tree.leaf);
      }
      to.part("tree");
    }
  }
}

void add_bush(SceneBuilder& to, double radius, int leaves) {
  to.begin("bush");
  for (int i = 0; i < 7; ++i) {
    Vector3d way = drawn_direction(to);
    way.z() = std::abs(way.z()) + 0.4;
    to.taper({0, 0, -0.1}, 0.8 * radius * way.normalized(), 0.015, 0.005);
  }
  for (int i = 0; i < leaves; ++i) {
    Vector3d way = drawn_direction(to);
    way.z() = std::abs(way.z());
    const double far = to.between(0.3, 1.0);
    add_leaf(to, far * radius * way, 0.1, 0.05);
  }
}

void add_fallen_trunk(SceneBuilder& to, double length, double radius) {
  to.begin("log");
  to.pole({0, 0, 0.8 * radius}, {length, 0, 0.6 * radius}, radius, 0.6 * radius);
  const int stumps = to.whole(3, 6);
  for (int i = 0; i < stumps; ++i) {
    const double at = to.between(0.3, 0.95) * length;
    Vector3d way = drawn_direction(to);
    way.z() = std::abs(way.z()) + 0.3;
    const double tall = to.between(0.3, 0.9);
    const Vector3d foot(at, 0, 0.7 * radius);
    to.taper(foot, foot + tall * way.normalized(), 0.25 * radius, 0.1 * radius);
  }
}

void add_rock(SceneBuilder& to, double radius) {
  to.begin("rock");
  const double phase = to.between(0.0, 6.0);
  constexpr int kAround = 12;
  constexpr int kUp = 5;
  const auto corner = [&](int i, int j) {
    const auto azimuth = math::sincos(2.0 * kPi * (i % kAround) / kAround);
    const auto elevation = math::sincos(0.5 * kPi * j / kUp);
    const double rough =
        1.0 + 0.22 * math::sin(phase + 2.3 * (i % kAround) + 1.9 * j) * (j == kUp ? 0.0 : 1.0);
    return Vector3d(radius * rough * elevation.cos * azimuth.cos,
                    radius * rough * elevation.cos * azimuth.sin,
                    0.75 * radius * rough * elevation.sin - (j == 0 ? 0.2 * radius : 0.0));
  };
  for (int i = 0; i < kAround; ++i) {
    for (int j = 0; j < kUp; ++j) {
      to.triangle(corner(i, j), corner(i + 1, j), corner(i + 1, j + 1));
      if (j + 1 < kUp) to.triangle(corner(i, j), corner(i + 1, j + 1), corner(i, j + 1));
    }
    to.triangle(corner(i, 0), corner(i + 1, 0), Vector3d(0, 0, -0.2 * radius));
  }
}

void add_grass(SceneBuilder& to, double radius, int blades, double height) {
  to.begin("grass");
  for (int i = 0; i < blades; ++i) {
    const auto heading = math::sincos(to.between(-kPi, kPi));
    const double far = radius * std::sqrt(to.between(0.0, 1.0));
    const double tall = to.between(0.5, 1.0) * height;
    const double bend_x = to.between(-0.4, 0.4) * tall;
    const double bend_y = to.between(-0.4, 0.4) * tall;
    const Vector3d foot(far * heading.cos, far * heading.sin, 0);
    to.triangle(foot - Vector3d(0.004, 0, 0),
                foot + Vector3d(0.004, 0, 0),
                foot + Vector3d(bend_x, bend_y, tall));
  }
}

}  // namespace pointflight::parts
