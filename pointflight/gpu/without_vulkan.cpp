// What stands for the rest of this folder in builds without Vulkan's headers: it says so.
#include "pointflight/core/input_error.hpp"
#include "pointflight/gpu/gpu_list.hpp"
#include "pointflight/gpu/gpu_renderer.hpp"
#include "pointflight/gpu/gpu_trial.hpp"

namespace pointflight {
namespace {

[[noreturn]] void refuse() {
  throw InputError(
      "no GPU: this build has no Vulkan; install libvulkan-dev and glslang-tools and build again");
}

}  // namespace

std::vector<GpuInfo> list_gpus() {
  refuse();
}

GpuInfo find_gpu(const std::string& /*index_or_name*/) {
  refuse();
}

void choose_gpu(const std::string& /*choice*/) {
  refuse();
}

GpuChoice chosen_gpu() {
  return {};
}

std::unique_ptr<Renderer> make_gpu_renderer(const Scene& /*scene*/) {
  refuse();
}

std::unique_ptr<Renderer> make_gpu_paper_renderer(const Scene& /*scene*/) {
  refuse();
}

std::unique_ptr<Renderer> make_automatic_renderer(const Scene& scene) {
  return Choice<RendererKind>("beam")->make(scene);  // `make_renderer` goes on behind surfels
}

std::vector<std::string> take_gpu_notices() {
  return {};
}

struct GpuTrial::Parts {};

GpuTrial::GpuTrial(const std::string& /*index_or_name*/) {
  refuse();
}

GpuTrial::~GpuTrial() = default;

std::size_t GpuTrial::rays() const {
  return 0;
}

void GpuTrial::trace_on_device() {}

void GpuTrial::trace_on_processor(const Executor& /*executor*/) {}

}  // namespace pointflight
