// A room that maps are made of.
#pragma once

#include <vector>

#include "pointflight/geometry/shape_scene.hpp"
#include "pointflight/io/cloud_reader.hpp"

namespace pointflight::testing {

inline ShapeScene small_room() {
  ShapeScene scene;
  scene.add_box({0, 0, 0}, {6, 5, 3});
  scene.shapes.emplace_back(SceneSphere{{3, 2, 1}, 0.6});
  return scene;
}

inline std::vector<CloudPoint> cloud_of(const ShapeScene& scene,
                                        double density,
                                        double noise = 0.0) {
  std::vector<CloudPoint> points;
  scene.sample(density, noise, 1, [&](const Vector3d& p) { points.push_back({p, 0.0f}); });
  return points;
}

}  // namespace pointflight::testing
