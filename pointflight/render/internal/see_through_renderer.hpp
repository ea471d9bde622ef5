#pragma once

#include <memory>

#include "pointflight/render/renderer.hpp"

namespace pointflight {

/// Lets rays through surfels that do not send all of them back (`Opacity`): what another renderer
/// finds there is drawn for, beam by beam (`RayBatch::draws`), and what goes through is traced on
/// from behind. Of a wide beam an echo as a whole comes back or not, and what lies behind is seen
/// by its axis alone. Renderers of images go on by rays, too.
class SeeThroughRenderer : public Renderer {
 public:
  SeeThroughRenderer(std::unique_ptr<Renderer> front, const Scene& scene);

  [[nodiscard]] std::unique_ptr<Rendering> submit(std::span<const RenderJob> jobs,
                                                  const Executor& executor) const override;
  [[nodiscard]] Hit trace(const Ray& ray) const override;
  [[nodiscard]] bool is_snapshot() const override { return front_->is_snapshot(); }
  [[nodiscard]] std::size_t jobs_at_once() const override { return front_->jobs_at_once(); }

 protected:
  void render_one(const RenderJob& job, const Executor& executor) const override;

 private:
  class Through;

  std::unique_ptr<Renderer> front_;
  std::unique_ptr<Renderer> behind_;  // rays
  std::shared_ptr<const SurfelMap> map_;
};

}  // namespace pointflight
