#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <span>
#include <stdexcept>
#include <string>

#include "pointflight/gpu/gpu_list.hpp"
#include "pointflight/gpu/internal/vulkan_functions.hpp"

namespace pointflight {

/// What a device does not do: it is lost, out of memory, or never had what is asked for.
class GpuError : public std::runtime_error {
 public:
  GpuError(const std::string& what, VkResult result);
  /// Of the call that failed.
  [[nodiscard]] VkResult result() const { return result_; }

 private:
  VkResult result_;
};

/// Throws GpuError unless a call was successful.
void require_success(VkResult result, const char* what);

/// A device that is open for computing. Shared by all that render on it; submissions of several
/// threads take turns.
class GpuDevice {
 public:
  /// The open one, if there is one. Throws GpuError.
  static std::shared_ptr<GpuDevice> open(const GpuInfo& info);

  explicit GpuDevice(const GpuInfo& info);
  ~GpuDevice();
  GpuDevice(const GpuDevice&) = delete;
  GpuDevice& operator=(const GpuDevice&) = delete;

  /// What it is.
  [[nodiscard]] const GpuInfo& info() const { return info_; }
  /// Vulkan's functions.
  [[nodiscard]] const VulkanFunctions& vk() const { return vk_; }
  /// Its handle.
  [[nodiscard]] VkDevice handle() const { return device_; }
  /// Of the queue that everything is submitted to.
  [[nodiscard]] std::uint32_t queue_family() const { return queue_family_; }
  /// True if subgroups vote and count ballots in compute shaders.
  [[nodiscard]] bool has_ballots() const { return has_ballots_; }
  /// Nanoseconds of a time stamp's tick.
  [[nodiscard]] double tick() const { return tick_; }
  /// The memory type for a buffer with these requirements.
  [[nodiscard]] std::uint32_t memory_type(std::uint32_t allowed,
                                          VkMemoryPropertyFlags required,
                                          VkMemoryPropertyFlags preferred) const;
  /// Waits until nothing is on its way.
  void wait_until_idle() noexcept;
  /// Starts a command buffer; `fence` says when it is through.
  void submit(VkCommandBuffer commands, VkFence fence);

 private:
  const VulkanFunctions& vk_;
  GpuInfo info_;
  VkPhysicalDevice physical_ = VK_NULL_HANDLE;
  VkPhysicalDeviceMemoryProperties memory_{};
  VkDevice device_ = VK_NULL_HANDLE;
  VkQueue queue_ = VK_NULL_HANDLE;
  std::mutex queue_mutex_;
  std::uint32_t queue_family_ = 0;
  bool has_ballots_ = false;
  double tick_ = 1.0;
};

/// Memory that a device computes with, or by which the host and it exchange what they have.
class GpuBuffer {
 public:
  /// Who uses it.
  enum class Use {
    kDevice,    ///< The device alone.
    kUpload,    ///< The host writes, the device copies.
    kReadBack,  ///< The device copies, the host reads.
  };

  GpuBuffer() = default;
  /// Throws GpuError. The device must outlive it.
  GpuBuffer(GpuDevice& device, std::uint64_t bytes, Use use);
  ~GpuBuffer();
  GpuBuffer(GpuBuffer&& other) noexcept;
  GpuBuffer& operator=(GpuBuffer&& other) noexcept;
  GpuBuffer(const GpuBuffer&) = delete;
  GpuBuffer& operator=(const GpuBuffer&) = delete;

  /// Its handle.
  [[nodiscard]] VkBuffer handle() const { return buffer_; }
  /// As asked for.
  [[nodiscard]] std::uint64_t bytes() const { return bytes_; }
  /// As the host sees it: `count` of T. Not of the device's own.
  template <class T>
  [[nodiscard]] std::span<T> as(std::size_t count) const {
    return {static_cast<T*>(mapped_), count};
  }

 private:
  GpuDevice* device_ = nullptr;
  VkBuffer buffer_ = VK_NULL_HANDLE;
  VkDeviceMemory memory_ = VK_NULL_HANDLE;
  std::uint64_t bytes_ = 0;
  void* mapped_ = nullptr;
};

}  // namespace pointflight
