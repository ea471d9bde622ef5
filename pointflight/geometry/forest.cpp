#include <algorithm>
#include <cmath>

#include "pointflight/core/constants.hpp"
#include "pointflight/core/math.hpp"
#include "pointflight/core/random.hpp"
#include "pointflight/geometry/shape_scene.hpp"

namespace pointflight {
namespace {

/// Draws numbered in order of use: the forest is one long deterministic sequence.
class Draws {
 public:
  explicit Draws(std::uint64_t seed) : random_(seed, StreamId::kForest, 0) {}
  double operator()(double low, double high) { return random_.uniform(next_++, low, high); }
  /// One of each pair of bounds, z first. Never as arguments of one call: those are computed in an
  /// order that each compiler chooses.
  Vector3d vector(const Vector3d& low, const Vector3d& high) {
    Vector3d drawn;
    for (int axis = 2; axis >= 0; --axis) drawn[axis] = (*this)(low[axis], high[axis]);
    return drawn;
  }

 private:
  RandomStream random_;
  std::uint64_t next_ = 0;
};

// gentle relief: a few waves of 5 m and more
double ground_height(double x, double y) {
  return 0.5 * math::sin(0.11 * x) * math::cos(0.09 * y) + 0.12 * math::sin(0.7 * x + 0.4 * y) +
         0.04 * math::sin(2.1 * x - 1.7 * y);
}

void add_ground(const ForestOptions& options, ShapeScene& scene) {
  constexpr double kStep = 0.5;
  const auto nx = static_cast<int>(std::ceil(options.size_x / kStep));
  const auto ny = static_cast<int>(std::ceil(options.size_y / kStep));
  const auto corner = [&](int i, int j) {
    const double x = std::min(i * kStep, options.size_x);
    const double y = std::min(j * kStep, options.size_y);
    return Vector3d(x, y, ground_height(x, y));
  };
  for (int i = 0; i < nx; ++i) {
    for (int j = 0; j < ny; ++j) {
      scene.shapes.emplace_back(Triangle{corner(i, j), corner(i + 1, j), corner(i + 1, j + 1)});
      scene.shapes.emplace_back(Triangle{corner(i, j), corner(i + 1, j + 1), corner(i, j + 1)});
    }
  }
}

void add_leaves(const Vector3d& around, Draws& draw, ShapeScene& scene) {
  constexpr int kLeaves = 10;
  for (int i = 0; i < kLeaves; ++i) {
    const Vector3d offset = draw.vector({-0.35, -0.35, -0.25}, {0.35, 0.35, 0.35});
    const Vector3d normal = draw.vector({-1.0, -1.0, 0.2}, {1.0, 1.0, 1.0}).normalized();
    scene.shapes.emplace_back(Disc{around + offset, normal, draw(0.04, 0.10)});
  }
}

void add_tree(const Vector3d& foot, const ForestOptions& options, Draws& draw, ShapeScene& scene) {
  const double height = draw(options.height_min, options.height_max);
  const double radius = draw(options.trunk_radius_min, options.trunk_radius_max);
  const double top_y = draw(-0.4, 0.4);
  const double top_x = draw(-0.4, 0.4);
  const Vector3d top = foot + Vector3d(top_x, top_y, height);
  scene.shapes.emplace_back(Cone{foot - Vector3d(0, 0, 0.3), top, radius, 0.2 * radius});
  // branches leave the upper two thirds of the trunk, with leaves at their ends
  const int branches = static_cast<int>(draw(6.0, 12.0));
  for (int i = 0; i < branches; ++i) {
    const double share = draw(0.35, 0.95);
    const auto heading = math::sincos(draw(0.0, 2.0 * kPi));
    const double length = draw(0.8, 2.2) * (1.2 - share);
    const Vector3d from = foot + share * (top - foot);
    const Vector3d to = from + length * Vector3d(heading.cos, heading.sin, draw(0.1, 0.7));
    const double thickness = 0.25 * radius * (1.1 - share) + 0.01;
    scene.shapes.emplace_back(Cone{from, to, thickness, 0.4 * thickness});
    add_leaves(to, draw, scene);
    add_leaves(from + 0.6 * (to - from), draw, scene);
  }
}

}  // namespace

ShapeScene make_forest(const ForestOptions& options) {
  Draws draw(options.seed);
  ShapeScene scene;
  add_ground(options, scene);
  const auto wanted = static_cast<std::size_t>(options.trees_per_hectare * options.size_x *
                                               options.size_y / 10000.0);
  std::vector<Vector3d> feet;
  for (std::size_t tries = 0; feet.size() < wanted && tries < 50 * wanted; ++tries) {
    const double x = draw(0.5, options.size_x - 0.5);
    const double y = draw(0.5, options.size_y - 0.5);
    const Vector3d foot(x, y, ground_height(x, y));
    const bool crowded = std::any_of(feet.begin(), feet.end(), [&](const Vector3d& other) {
      return (other - foot).head<2>().norm() < options.min_spacing;
    });
    if (!crowded) feet.push_back(foot);
  }
  for (const Vector3d& foot : feet) add_tree(foot, options, draw, scene);
  return scene;
}

}  // namespace pointflight
