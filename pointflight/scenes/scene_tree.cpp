#include "pointflight/scenes/scene_tree.hpp"

#include <cmath>

#include "pointflight/core/math.hpp"
#include "pointflight/scenes/scene_class.hpp"

namespace pointflight {
namespace {

constexpr double kBehindGlass = 1e-4;  // m

/// Point `i` of `count` spread evenly over the unit sphere (Fibonacci's spiral).
Vector3d spread_direction(std::size_t i, std::size_t count) {
  const double z = 1.0 - (2.0 * static_cast<double>(i) + 1.0) / static_cast<double>(count);
  return unit_direction(static_cast<double>(i) * 2.399963229728653, math::asin(z));
}

}  // namespace

Vector3d unit_direction(double azimuth, double elevation) {
  const auto a = math::sincos(azimuth);
  const auto e = math::sincos(elevation);
  return {e.cos * a.cos, e.cos * a.sin, e.sin};
}

SceneTree::SceneTree(const ExactScene& scene) : scene_(scene), tree_(scene.geometry.shapes) {
  for (const std::string& tag : scene.tags) mirrors_.push_back(opacity_of_class(tag));
}

std::optional<ShapeTree::Hit> SceneTree::intersect(const Vector3d& origin,
                                                   const Vector3d& direction) const {
  constexpr int kPanes = 64;
  double passed = 0.0;
  for (int i = 0; i < kPanes; ++i) {
    const Vector3d from = origin + passed * direction;
    auto met = tree_.intersect(from, direction);
    if (!met) return std::nullopt;
    const Vector3d normal =
        normal_at(scene_.geometry.shapes[met->shape], from + met->range * direction);
    const auto fate = Opacity::fate(mirrors_[scene_.shape_tag[met->shape]],
                                    static_cast<float>(std::abs(normal.dot(direction))),
                                    0.0);
    if (fate == Opacity::Fate::kLost) return std::nullopt;
    passed += met->range;
    if (fate == Opacity::Fate::kReturns) {
      met->range = passed;
      return met;
    }
    passed += kBehindGlass;
  }
  return std::nullopt;
}

bool SceneTree::is_free(const Vector3d& place, double radius, std::size_t looks) const {
  for (std::size_t i = 0; i < looks; ++i) {
    const auto met = tree_.intersect(place, spread_direction(i, looks));
    if (met && met->range < radius) return false;
  }
  return true;
}

}  // namespace pointflight
