#pragma once

#include "pointflight/render/renderer.hpp"
#include "pointflight/scenes/scene_tree.hpp"

namespace pointflight {

/// An exact scene in place of a map: `Lidar::take` with it is what a sensor sees of the scene
/// itself. Hits have no surfel and no intensity; bodies are not seen.
class SceneRenderer : public Renderer {
 public:
  /// Both must outlive the renderer.
  SceneRenderer(const ExactScene& scene, const SceneTree& tree) : scene_(scene), tree_(tree) {}

 protected:
  void render_one(const RenderJob& job, const Executor& executor) const override;

 private:
  const ExactScene& scene_;
  const SceneTree& tree_;
};

}  // namespace pointflight
