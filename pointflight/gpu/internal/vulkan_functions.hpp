#pragma once

#define VK_NO_PROTOTYPES
#include <vulkan/vulkan_core.h>

#include <string>
#include <vector>

namespace pointflight {

// NOLINTBEGIN(cppcoreguidelines-macro-usage): a list of functions, each of which is named once
#define POINTFLIGHT_VULKAN_FUNCTIONS(F)     \
  F(DestroyInstance)                        \
  F(EnumeratePhysicalDevices)               \
  F(GetPhysicalDeviceProperties2)           \
  F(GetPhysicalDeviceFeatures)              \
  F(GetPhysicalDeviceMemoryProperties)      \
  F(GetPhysicalDeviceQueueFamilyProperties) \
  F(CreateDevice)                           \
  F(DestroyDevice)                          \
  F(GetDeviceQueue)                         \
  F(DeviceWaitIdle)                         \
  F(CreateBuffer)                           \
  F(DestroyBuffer)                          \
  F(GetBufferMemoryRequirements)            \
  F(AllocateMemory)                         \
  F(FreeMemory)                             \
  F(BindBufferMemory)                       \
  F(MapMemory)                              \
  F(CreateShaderModule)                     \
  F(DestroyShaderModule)                    \
  F(CreateDescriptorSetLayout)              \
  F(DestroyDescriptorSetLayout)             \
  F(CreatePipelineLayout)                   \
  F(DestroyPipelineLayout)                  \
  F(CreateComputePipelines)                 \
  F(DestroyPipeline)                        \
  F(CreateDescriptorPool)                   \
  F(DestroyDescriptorPool)                  \
  F(AllocateDescriptorSets)                 \
  F(UpdateDescriptorSets)                   \
  F(CreateCommandPool)                      \
  F(DestroyCommandPool)                     \
  F(AllocateCommandBuffers)                 \
  F(BeginCommandBuffer)                     \
  F(EndCommandBuffer)                       \
  F(CmdBindPipeline)                        \
  F(CmdBindDescriptorSets)                  \
  F(CmdPushConstants)                       \
  F(CmdDispatch)                            \
  F(CmdCopyBuffer)                          \
  F(CmdFillBuffer)                          \
  F(CmdPipelineBarrier)                     \
  F(CmdResetQueryPool)                      \
  F(CmdWriteTimestamp)                      \
  F(CreateQueryPool)                        \
  F(DestroyQueryPool)                       \
  F(GetQueryPoolResults)                    \
  F(CreateFence)                            \
  F(DestroyFence)                           \
  F(ResetFences)                            \
  F(WaitForFences)                          \
  F(QueueSubmit)
// NOLINTEND(cppcoreguidelines-macro-usage)

/// An instance of Vulkan 1.1, by the loader of the system, which is opened at run time: the program
/// runs without. Never closed: drivers do not take it well.
class VulkanFunctions {
 public:
  /// The process's own. Throws InputError if there is no loader or it has no instance.
  static const VulkanFunctions& get();

  /// What the layer that checks how Vulkan is used has said since this was last asked: where it is
  /// installed, and the environment has POINTFLIGHT_VULKAN_VALIDATION. For tests.
  static std::vector<std::string> take_validation_messages();

  VkInstance instance = VK_NULL_HANDLE;  ///< Of Vulkan 1.1.
#define POINTFLIGHT_DECLARE(name) PFN_vk##name name = nullptr;
  /// As the specification names them, without "vk".
  ///@{
  POINTFLIGHT_VULKAN_FUNCTIONS(POINTFLIGHT_DECLARE)
  ///@}
#undef POINTFLIGHT_DECLARE

 private:
  VulkanFunctions();
  void listen_to_validation(PFN_vkGetInstanceProcAddr load) const;
};

}  // namespace pointflight
