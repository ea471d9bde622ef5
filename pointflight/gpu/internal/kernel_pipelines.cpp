#include "pointflight/gpu/internal/kernel_pipelines.hpp"

#include <array>

namespace pointflight::device {
// SPIR-V of kernel/rays.comp: PERSISTENT, EXACT_BY; of kernel/wide.comp: EXACT_BY
#include "pointflight/gpu/kernels/rays_0_0.inc"
#include "pointflight/gpu/kernels/rays_0_1.inc"
#include "pointflight/gpu/kernels/rays_0_2.inc"
#include "pointflight/gpu/kernels/rays_1_0.inc"
#include "pointflight/gpu/kernels/rays_1_1.inc"
#include "pointflight/gpu/kernels/rays_1_2.inc"
#include "pointflight/gpu/kernels/wide_0.inc"
#include "pointflight/gpu/kernels/wide_1.inc"
#include "pointflight/gpu/kernels/wide_2.inc"
}  // namespace pointflight::device

namespace pointflight {
namespace {

using Code = std::span<const std::uint32_t>;

Code code_of_rays(const RayKernel& kernel) {
  const Code plain[3] = {device::rays_0_0, device::rays_0_1, device::rays_0_2};
  const Code persistent[3] = {device::rays_1_0, device::rays_1_1, device::rays_1_2};
  const auto exact = static_cast<std::size_t>(kernel.exact);
  return kernel.is_persistent ? persistent[exact] : plain[exact];
}

Code code_of_wide(const RayKernel& kernel) {
  const Code all[3] = {device::wide_0, device::wide_1, device::wide_2};
  return all[static_cast<std::size_t>(kernel.exact)];
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

KernelPipelines::KernelPipelines(GpuDevice& device, const RayKernel& kernel) : device_(device) {
  try {
    make_layout();
    rays_ = made_of(code_of_rays(kernel), kernel.most_chunks);
    wide_ = made_of(code_of_wide(kernel), 0);
  } catch (const GpuError&) {
    release();
    throw;
  }
}

KernelPipelines::~KernelPipelines() {
  release();
}

void KernelPipelines::release() noexcept {
  const VulkanFunctions& vk = device_.vk();
  VkDevice handle = device_.handle();
  vk.DestroyPipeline(handle, wide_, nullptr);
  vk.DestroyPipeline(handle, rays_, nullptr);
  vk.DestroyPipelineLayout(handle, layout_, nullptr);
  vk.DestroyDescriptorSetLayout(handle, set_layout_, nullptr);
}

void KernelPipelines::make_layout() {
  const VulkanFunctions& vk = device_.vk();
  VkDevice handle = device_.handle();
  std::array<VkDescriptorSetLayoutBinding, kBindings> bindings{};
  for (std::uint32_t i = 0; i < kBindings; ++i) {
    bindings[i].binding = i;
    bindings[i].descriptorType = VK_DESCRIPTOR_TYPE_STORAGE_BUFFER;
    bindings[i].descriptorCount = 1;
    bindings[i].stageFlags = VK_SHADER_STAGE_COMPUTE_BIT;
  }
  VkDescriptorSetLayoutCreateInfo set{};
  set.sType = VK_STRUCTURE_TYPE_DESCRIPTOR_SET_LAYOUT_CREATE_INFO;
  set.bindingCount = kBindings;
  set.pBindings = bindings.data();
  require_success(vk.CreateDescriptorSetLayout(handle, &set, nullptr, &set_layout_), "kernel");
  const VkPushConstantRange call{VK_SHADER_STAGE_COMPUTE_BIT, 0, sizeof(device::DeviceCall)};
  VkPipelineLayoutCreateInfo layout{};
  layout.sType = VK_STRUCTURE_TYPE_PIPELINE_LAYOUT_CREATE_INFO;
  layout.setLayoutCount = 1;
  layout.pSetLayouts = &set_layout_;
  layout.pushConstantRangeCount = 1;
  layout.pPushConstantRanges = &call;
  require_success(vk.CreatePipelineLayout(handle, &layout, nullptr, &layout_), "kernel");
}

VkPipeline KernelPipelines::made_of(std::span<const std::uint32_t> code,
                                    std::uint32_t most_chunks) const {
  const VulkanFunctions& vk = device_.vk();
  VkDevice handle = device_.handle();
  VkShaderModuleCreateInfo module{};
  module.sType = VK_STRUCTURE_TYPE_SHADER_MODULE_CREATE_INFO;
  module.codeSize = code.size_bytes();
  module.pCode = code.data();
  VkShaderModule shader = VK_NULL_HANDLE;
  require_success(vk.CreateShaderModule(handle, &module, nullptr, &shader), "kernel");
  const VkSpecializationMapEntry entry{0, 0, sizeof most_chunks};
  const VkSpecializationInfo constants{1, &entry, sizeof most_chunks, &most_chunks};
  VkComputePipelineCreateInfo pipeline{};
  pipeline.sType = VK_STRUCTURE_TYPE_COMPUTE_PIPELINE_CREATE_INFO;
  pipeline.stage.sType = VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_CREATE_INFO;
  pipeline.stage.stage = VK_SHADER_STAGE_COMPUTE_BIT;
  pipeline.stage.module = shader;
  pipeline.stage.pName = "main";
  pipeline.stage.pSpecializationInfo = &constants;
  pipeline.layout = layout_;
  VkPipeline made = VK_NULL_HANDLE;
  const VkResult result =
      vk.CreateComputePipelines(handle, VK_NULL_HANDLE, 1, &pipeline, nullptr, &made);
  vk.DestroyShaderModule(handle, shader, nullptr);
  require_success(result, "kernel");
  return made;
}

}  // namespace pointflight
