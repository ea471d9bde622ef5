#include "pointflight/gpu/internal/device_commands.hpp"

namespace pointflight {

void record_barrier(const VulkanFunctions& vk, VkCommandBuffer commands) {
  VkMemoryBarrier barrier{};
  barrier.sType = VK_STRUCTURE_TYPE_MEMORY_BARRIER;
  barrier.srcAccessMask = VK_ACCESS_SHADER_WRITE_BIT | VK_ACCESS_TRANSFER_WRITE_BIT;
  barrier.dstAccessMask = VK_ACCESS_SHADER_READ_BIT | VK_ACCESS_SHADER_WRITE_BIT |
                          VK_ACCESS_TRANSFER_READ_BIT | VK_ACCESS_HOST_READ_BIT;
  constexpr VkPipelineStageFlags kStages =
      VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT | VK_PIPELINE_STAGE_TRANSFER_BIT;
  vk.CmdPipelineBarrier(commands,
                        kStages,
                        kStages | VK_PIPELINE_STAGE_HOST_BIT,
                        0,
                        1,
                        &barrier,
                        0,
                        nullptr,
                        0,
                        nullptr);
}

DeviceCommands::DeviceCommands(GpuDevice& device) : device_(device) {
  const VulkanFunctions& vk = device.vk();
  VkCommandPoolCreateInfo pool{};
  pool.sType = VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO;
  pool.flags = VK_COMMAND_POOL_CREATE_RESET_COMMAND_BUFFER_BIT;
  pool.queueFamilyIndex = device.queue_family();
  require_success(vk.CreateCommandPool(device.handle(), &pool, nullptr, &pool_), "commands");
  VkCommandBufferAllocateInfo commands{};
  commands.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO;
  commands.commandPool = pool_;
  commands.commandBufferCount = 1;
  VkFenceCreateInfo fence{};
  fence.sType = VK_STRUCTURE_TYPE_FENCE_CREATE_INFO;
  const bool has_both =
      vk.AllocateCommandBuffers(device.handle(), &commands, &commands_) == VK_SUCCESS &&
      vk.CreateFence(device.handle(), &fence, nullptr, &fence_) == VK_SUCCESS;
  if (has_both) return;
  vk.DestroyCommandPool(device.handle(), pool_, nullptr);
  throw GpuError("commands", VK_ERROR_OUT_OF_HOST_MEMORY);
}

DeviceCommands::~DeviceCommands() {
  device_.wait_until_idle();
  device_.vk().DestroyFence(device_.handle(), fence_, nullptr);
  device_.vk().DestroyCommandPool(device_.handle(), pool_, nullptr);
}

VkCommandBuffer DeviceCommands::begin() {
  VkCommandBufferBeginInfo begin{};
  begin.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO;
  begin.flags = VK_COMMAND_BUFFER_USAGE_ONE_TIME_SUBMIT_BIT;
  require_success(device_.vk().BeginCommandBuffer(commands_, &begin), "commands");
  return commands_;
}

void DeviceCommands::run(std::uint64_t timeout) {
  const VulkanFunctions& vk = device_.vk();
  const char* name = device_.info().name.c_str();
  require_success(vk.EndCommandBuffer(commands_), "commands");
  device_.submit(commands_, fence_);
  require_success(vk.WaitForFences(device_.handle(), 1, &fence_, VK_TRUE, timeout), name);
  require_success(vk.ResetFences(device_.handle(), 1, &fence_), name);
}

}  // namespace pointflight
