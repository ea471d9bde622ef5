#include "pointflight/gpu/internal/kernel_pipelines.hpp"

namespace pointflight::device {
// SPIR-V of kernel/rays.comp: SPLIT, PERSISTENT, EXACT_BY; of kernel/wide.comp: SPLIT, EXACT_BY
#include "pointflight/gpu/kernels/rays_0_0_0.inc"
#include "pointflight/gpu/kernels/rays_0_0_1.inc"
#include "pointflight/gpu/kernels/rays_0_0_2.inc"
#include "pointflight/gpu/kernels/rays_0_1_0.inc"
#include "pointflight/gpu/kernels/rays_0_1_1.inc"
#include "pointflight/gpu/kernels/rays_0_1_2.inc"
#include "pointflight/gpu/kernels/rays_1_0_0.inc"
#include "pointflight/gpu/kernels/rays_1_0_1.inc"
#include "pointflight/gpu/kernels/rays_1_0_2.inc"
#include "pointflight/gpu/kernels/rays_1_1_0.inc"
#include "pointflight/gpu/kernels/rays_1_1_1.inc"
#include "pointflight/gpu/kernels/rays_1_1_2.inc"
#include "pointflight/gpu/kernels/wide_0_0.inc"
#include "pointflight/gpu/kernels/wide_0_1.inc"
#include "pointflight/gpu/kernels/wide_0_2.inc"
#include "pointflight/gpu/kernels/wide_1_0.inc"
#include "pointflight/gpu/kernels/wide_1_1.inc"
#include "pointflight/gpu/kernels/wide_1_2.inc"
}  // namespace pointflight::device

namespace pointflight {
namespace {

using Code = std::span<const std::uint32_t>;

Code code_of_rays(const RayKernel& kernel, bool is_split) {
  const Code all[2][2][3] = {{{device::rays_0_0_0, device::rays_0_0_1, device::rays_0_0_2},
                              {device::rays_0_1_0, device::rays_0_1_1, device::rays_0_1_2}},
                             {{device::rays_1_0_0, device::rays_1_0_1, device::rays_1_0_2},
                              {device::rays_1_1_0, device::rays_1_1_1, device::rays_1_1_2}}};
  const auto exact = static_cast<std::size_t>(kernel.exact);
  return all[is_split ? 1 : 0][kernel.is_persistent ? 1 : 0][exact];
}

Code code_of_wide(const RayKernel& kernel, bool is_split) {
  const Code all[2][3] = {{device::wide_0_0, device::wide_0_1, device::wide_0_2},
                          {device::wide_1_0, device::wide_1_1, device::wide_1_2}};
  return all[is_split ? 1 : 0][static_cast<std::size_t>(kernel.exact)];
}

}  // namespace

std::string name_of(const RayKernel& kernel) {
  const char* const names[3] = {"the device's own division", "fused multiply-add", "doubles"};
  return names[static_cast<std::size_t>(kernel.exact)];
}

std::vector<RayKernel> kernels_for(const GpuDevice& device) {
  const bool persistent = device.has_ballots() && !device.info().is_processor;
  std::vector<RayKernel> kernels{{ExactBy::kResiduals, persistent, 0}};
  if (device.info().has_doubles) kernels.push_back({ExactBy::kDoubles, persistent, 0});
  kernels.push_back({ExactBy::kDevice, persistent, 0});
  return kernels;
}

KernelPipelines::KernelPipelines(GpuDevice& device, const RayKernel& kernel, bool is_split)
    : device_(device),
      layout_(device, is_split ? kAllBindings : kBindings, sizeof(device::DeviceCall)) {
  try {
    rays_ = layout_.kernel_of(code_of_rays(kernel, is_split), kernel.most_chunks);
    wide_ = layout_.kernel_of(code_of_wide(kernel, is_split), 0);
  } catch (const GpuError&) {
    release();
    throw;
  }
}

KernelPipelines::~KernelPipelines() {
  release();
}

void KernelPipelines::release() noexcept {
  device_.vk().DestroyPipeline(device_.handle(), wide_, nullptr);
  device_.vk().DestroyPipeline(device_.handle(), rays_, nullptr);
}

}  // namespace pointflight
