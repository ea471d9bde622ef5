#include "pointflight/gpu/gpu_trial.hpp"

#include <algorithm>
#include <numeric>
#include <optional>
#include <vector>

#include "pointflight/core/input_error.hpp"
#include "pointflight/gpu/internal/kernel_choice.hpp"
#include "pointflight/render/internal/beam_kernel.hpp"

namespace pointflight {
namespace {

constexpr std::size_t kSpeedRays = std::size_t{1} << 17;
constexpr std::size_t kTrialChunk = 1024;  // rays

/// What a device does not do, for users.
template <class Action>
auto in_words(const Action& action) {
  try {
    return action();
  } catch (const GpuError& error) {
    throw InputError(error.what());
  }
}

}  // namespace

struct GpuTrial::Parts {
  Parts(const std::shared_ptr<GpuDevice>& opened, const RayKernel& kernel)
      : device(opened), there(*device, *map), tracer(*device, there, kernel), order(rays.size()) {
    std::iota(order.begin(), order.end(), 0u);
  }

  std::shared_ptr<const SurfelMap> map = trial_scene();
  KernelMap kernel_map = kernel_map_of(*map);
  std::vector<MapRay> rays = map_rays(kernel_map, trial_rays(kSpeedRays));
  std::shared_ptr<GpuDevice> device;
  DeviceMap there;
  RayTracer tracer;
  std::vector<std::uint32_t> order;
  std::vector<KernelHit> hits{kSpeedRays};
};

GpuTrial::GpuTrial(const std::string& index_or_name) {
  const GpuInfo info = find_gpu(index_or_name);
  in_words([&] {
    const auto device = GpuDevice::open(info);
    const std::optional<RayKernel> exact = exact_kernel(*device);
    const RayKernel kernel = exact.value_or(kernels_for(*device).front());
    if (exact) exact_by_ = name_of(*exact);
    parts_ = std::make_unique<Parts>(device, kernel);
    equal_ = count_equal(*device, parts_->there, kernel, kSpeedRays);
  });
}

GpuTrial::~GpuTrial() = default;

std::size_t GpuTrial::rays() const {
  return kSpeedRays;
}

void GpuTrial::trace_on_device() {
  Parts& p = *parts_;
  in_words([&] {
    std::copy(p.rays.begin(), p.rays.end(), p.tracer.rays(0, kSpeedRays).begin());
    p.tracer.submit(0, kSpeedRays);
    p.tracer.wait(0);
  });
}

void GpuTrial::trace_on_processor(const Executor& executor) {
  Parts& p = *parts_;
  executor.parallel_for(kSpeedRays, kTrialChunk, [&](std::size_t begin, std::size_t end) {
    trace_beams(p.kernel_map, p.rays, std::span(p.order).subspan(begin, end - begin), p.hits);
  });
}

}  // namespace pointflight
