#include "pointflight/gpu/gpu_renderer.hpp"

namespace pointflight {

void add_gpu_renderer() {
  static const bool once = [] {
    RendererKind::table().add({.name = "gpu",
                               .help = "as beam, to the same bits, on a GPU by Vulkan",
                               .make = make_gpu_renderer,
                               .one_pose = false});
    RendererKind::table().add(
        {.name = "auto",
         .help = "gpu where there is one and the batch is worth it, else beam",
         .make = make_automatic_renderer,
         .one_pose = false});
    RendererKind::table().add({.name = "gpu-paper",
                               .help = "as paper, to the same bits, on a GPU by Vulkan",
                               .make = make_gpu_paper_renderer,
                               .one_pose = true});
    return true;
  }();
  static_cast<void>(once);
}

}  // namespace pointflight
