#include "pointflight/gpu/internal/kernel_layout.hpp"

#include <vector>

namespace pointflight {

KernelLayout::KernelLayout(GpuDevice& device, std::uint32_t bindings, std::uint32_t push_bytes)
    : device_(device), bindings_(bindings) {
  const VulkanFunctions& vk = device.vk();
  std::vector<VkDescriptorSetLayoutBinding> all(bindings);
  for (std::uint32_t i = 0; i < bindings; ++i) {
    all[i].binding = i;
    all[i].descriptorType = VK_DESCRIPTOR_TYPE_STORAGE_BUFFER;
    all[i].descriptorCount = 1;
    all[i].stageFlags = VK_SHADER_STAGE_COMPUTE_BIT;
  }
  VkDescriptorSetLayoutCreateInfo set{};
  set.sType = VK_STRUCTURE_TYPE_DESCRIPTOR_SET_LAYOUT_CREATE_INFO;
  set.bindingCount = bindings;
  set.pBindings = all.data();
  require_success(vk.CreateDescriptorSetLayout(device.handle(), &set, nullptr, &set_layout_),
                  "kernel");
  const VkPushConstantRange call{VK_SHADER_STAGE_COMPUTE_BIT, 0, push_bytes};
  VkPipelineLayoutCreateInfo layout{};
  layout.sType = VK_STRUCTURE_TYPE_PIPELINE_LAYOUT_CREATE_INFO;
  layout.setLayoutCount = 1;
  layout.pSetLayouts = &set_layout_;
  layout.pushConstantRangeCount = 1;
  layout.pPushConstantRanges = &call;
  const VkResult made = vk.CreatePipelineLayout(device.handle(), &layout, nullptr, &layout_);
  if (made == VK_SUCCESS) return;
  vk.DestroyDescriptorSetLayout(device.handle(), set_layout_, nullptr);
  throw GpuError("kernel", made);
}

KernelLayout::~KernelLayout() {
  device_.vk().DestroyPipelineLayout(device_.handle(), layout_, nullptr);
  device_.vk().DestroyDescriptorSetLayout(device_.handle(), set_layout_, nullptr);
}

VkPipeline KernelLayout::kernel_of(std::span<const std::uint32_t> code,
                                   std::uint32_t constant) const {
  const VulkanFunctions& vk = device_.vk();
  VkDevice handle = device_.handle();
  VkShaderModuleCreateInfo module{};
  module.sType = VK_STRUCTURE_TYPE_SHADER_MODULE_CREATE_INFO;
  module.codeSize = code.size_bytes();
  module.pCode = code.data();
  VkShaderModule shader = VK_NULL_HANDLE;
  require_success(vk.CreateShaderModule(handle, &module, nullptr, &shader), "kernel");
  const VkSpecializationMapEntry entry{0, 0, sizeof constant};
  const VkSpecializationInfo constants{1, &entry, sizeof constant, &constant};
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

void bind_buffers(GpuDevice& device,
                  VkDescriptorSet set,
                  std::span<const VkDescriptorBufferInfo> buffers) {
  std::vector<VkWriteDescriptorSet> writes(buffers.size());
  for (std::size_t i = 0; i < buffers.size(); ++i) {
    writes[i].sType = VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET;
    writes[i].dstSet = set;
    writes[i].dstBinding = static_cast<std::uint32_t>(i);
    writes[i].descriptorCount = 1;
    writes[i].descriptorType = VK_DESCRIPTOR_TYPE_STORAGE_BUFFER;
    writes[i].pBufferInfo = &buffers[i];
  }
  device.vk().UpdateDescriptorSets(
      device.handle(), static_cast<std::uint32_t>(writes.size()), writes.data(), 0, nullptr);
}

}  // namespace pointflight
