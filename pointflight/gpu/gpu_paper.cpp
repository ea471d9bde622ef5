#include "pointflight/gpu/gpu_renderer.hpp"
#include "pointflight/gpu/internal/device_painter.hpp"
#include "pointflight/render/internal/paper_renderer.hpp"

namespace pointflight {

std::unique_ptr<Renderer> make_gpu_paper_renderer(const Scene& scene) {
  return open_on_gpu("paper", [&](const ExactGpu& gpu) {
    return std::make_unique<PaperRenderer>(
        scene, PaperOptions{}, [&](std::span<const PaperVoxel> voxels) {
          return make_device_painter(gpu, voxels);
        });
  });
}

}  // namespace pointflight
