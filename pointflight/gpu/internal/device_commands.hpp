#pragma once

#include <cstdint>

#include "pointflight/gpu/internal/gpu_device.hpp"

namespace pointflight {

/// What is written before is seen by what comes after, on the device and by the host.
void record_barrier(const VulkanFunctions& vk, VkCommandBuffer commands);

/// Commands that a device gets and is waited for.
class DeviceCommands {
 public:
  /// The device must outlive it. Throws GpuError.
  explicit DeviceCommands(GpuDevice& device);
  /// Waits for what is on its way.
  ~DeviceCommands();
  DeviceCommands(const DeviceCommands&) = delete;
  DeviceCommands& operator=(const DeviceCommands&) = delete;

  /// To record into. Throws GpuError.
  VkCommandBuffer begin();
  /// Sends off what was recorded and waits, so many nanoseconds at most. Throws GpuError.
  void run(std::uint64_t timeout);

 private:
  GpuDevice& device_;
  VkCommandPool pool_ = VK_NULL_HANDLE;
  VkCommandBuffer commands_ = VK_NULL_HANDLE;
  VkFence fence_ = VK_NULL_HANDLE;
};

}  // namespace pointflight
