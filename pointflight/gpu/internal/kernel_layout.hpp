#pragma once

#include <cstdint>
#include <span>

#include "pointflight/gpu/internal/gpu_device.hpp"

namespace pointflight {

/// What kernels are bound to: storage buffers and numbers that come with each dispatch.
class KernelLayout {
 public:
  /// The device must outlive it. Throws GpuError.
  KernelLayout(GpuDevice& device, std::uint32_t bindings, std::uint32_t push_bytes);
  ~KernelLayout();
  KernelLayout(const KernelLayout&) = delete;
  KernelLayout& operator=(const KernelLayout&) = delete;

  [[nodiscard]] VkDescriptorSetLayout set_layout() const { return set_layout_; }
  [[nodiscard]] VkPipelineLayout handle() const { return layout_; }
  /// How many buffers.
  [[nodiscard]] std::uint32_t bindings() const { return bindings_; }
  /// A kernel of SPIR-V whose constant 0 is `constant`; whoever calls destroys it. Throws GpuError.
  [[nodiscard]] VkPipeline kernel_of(std::span<const std::uint32_t> code,
                                     std::uint32_t constant) const;

 private:
  GpuDevice& device_;
  std::uint32_t bindings_;
  VkDescriptorSetLayout set_layout_ = VK_NULL_HANDLE;
  VkPipelineLayout layout_ = VK_NULL_HANDLE;
};

/// Points a set at buffers, one a binding.
void bind_buffers(GpuDevice& device,
                  VkDescriptorSet set,
                  std::span<const VkDescriptorBufferInfo> buffers);

}  // namespace pointflight
