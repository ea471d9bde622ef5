#include "pointflight/gpu/internal/gpu_device.hpp"

#include <fmt/format.h>

#include <map>
#include <utility>
#include <vector>

#include "pointflight/gpu/internal/physical_devices.hpp"

namespace pointflight {
namespace {

std::string words_of(VkResult result) {
  switch (result) {
    case VK_ERROR_OUT_OF_HOST_MEMORY:
    case VK_ERROR_OUT_OF_DEVICE_MEMORY:
      return "out of memory";
    case VK_ERROR_DEVICE_LOST:
      return "the device is lost";
    case VK_TIMEOUT:
      return "it does not answer";
    default:
      return fmt::format("error {}", static_cast<int>(result));
  }
}

/// The first family of queues that computes; such that do nothing else go before.
std::uint32_t computing_family(const VulkanFunctions& vk, VkPhysicalDevice device) {
  std::uint32_t count = 0;
  vk.GetPhysicalDeviceQueueFamilyProperties(device, &count, nullptr);
  std::vector<VkQueueFamilyProperties> families(count);
  vk.GetPhysicalDeviceQueueFamilyProperties(device, &count, families.data());
  const auto find = [&](VkQueueFlags without) {
    for (std::uint32_t i = 0; i < families.size(); ++i) {
      const VkQueueFlags flags = families[i].queueFlags;
      if ((flags & VK_QUEUE_COMPUTE_BIT) != 0 && (flags & without) == 0) return i;
    }
    return count;
  };
  const std::uint32_t own = find(VK_QUEUE_GRAPHICS_BIT);
  const std::uint32_t any = own < count ? own : find(0);
  if (any == count) throw GpuError("no queue that computes", VK_ERROR_FEATURE_NOT_PRESENT);
  return any;
}

bool votes_and_counts(const VulkanFunctions& vk, VkPhysicalDevice device) {
  VkPhysicalDeviceSubgroupProperties subgroup{};
  subgroup.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_SUBGROUP_PROPERTIES;
  VkPhysicalDeviceProperties2 all{};
  all.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PROPERTIES_2;
  all.pNext = &subgroup;
  vk.GetPhysicalDeviceProperties2(device, &all);
  constexpr VkSubgroupFeatureFlags kWanted =
      VK_SUBGROUP_FEATURE_BASIC_BIT | VK_SUBGROUP_FEATURE_VOTE_BIT | VK_SUBGROUP_FEATURE_BALLOT_BIT;
  return (subgroup.supportedOperations & kWanted) == kWanted &&
         (subgroup.supportedStages & VK_SHADER_STAGE_COMPUTE_BIT) != 0;
}

}  // namespace

GpuError::GpuError(const std::string& what, VkResult result)
    : std::runtime_error(fmt::format("{}: {}", what, words_of(result))), result_(result) {}

void require_success(VkResult result, const char* what) {
  if (result != VK_SUCCESS) throw GpuError(what, result);
}

std::shared_ptr<GpuDevice> GpuDevice::open(const GpuInfo& info) {
  static std::mutex mutex;
  static std::map<std::size_t, std::weak_ptr<GpuDevice>> all;
  const std::lock_guard lock(mutex);
  std::weak_ptr<GpuDevice>& known = all[info.index];
  std::shared_ptr<GpuDevice> device = known.lock();
  if (!device) {
    device = std::make_shared<GpuDevice>(info);
    known = device;
  }
  return device;
}

GpuDevice::GpuDevice(const GpuInfo& info) : vk_(VulkanFunctions::get()), info_(info) {
  const std::vector<VkPhysicalDevice> devices = physical_devices(vk_);
  if (info.index >= devices.size()) throw GpuError(info.name, VK_ERROR_DEVICE_LOST);
  physical_ = devices[info.index];
  vk_.GetPhysicalDeviceMemoryProperties(physical_, &memory_);
  queue_family_ = computing_family(vk_, physical_);
  has_ballots_ = votes_and_counts(vk_, physical_);
  VkPhysicalDeviceProperties2 all{};
  all.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PROPERTIES_2;
  vk_.GetPhysicalDeviceProperties2(physical_, &all);
  tick_ = static_cast<double>(all.properties.limits.timestampPeriod);

  const float priority = 1.0f;
  VkDeviceQueueCreateInfo queue{};
  queue.sType = VK_STRUCTURE_TYPE_DEVICE_QUEUE_CREATE_INFO;
  queue.queueFamilyIndex = queue_family_;
  queue.queueCount = 1;
  queue.pQueuePriorities = &priority;
  VkPhysicalDeviceFeatures features{};
  features.shaderFloat64 = info.has_doubles ? VK_TRUE : VK_FALSE;
  VkDeviceCreateInfo create{};
  create.sType = VK_STRUCTURE_TYPE_DEVICE_CREATE_INFO;
  create.queueCreateInfoCount = 1;
  create.pQueueCreateInfos = &queue;
  create.pEnabledFeatures = &features;
  require_success(vk_.CreateDevice(physical_, &create, nullptr, &device_), info.name.c_str());
  vk_.GetDeviceQueue(device_, queue_family_, 0, &queue_);
}

GpuDevice::~GpuDevice() {
  vk_.DeviceWaitIdle(device_);
  vk_.DestroyDevice(device_, nullptr);
}

std::uint32_t GpuDevice::memory_type(std::uint32_t allowed,
                                     VkMemoryPropertyFlags required,
                                     VkMemoryPropertyFlags preferred) const {
  std::uint32_t found = memory_.memoryTypeCount;
  for (std::uint32_t i = 0; i < memory_.memoryTypeCount; ++i) {
    const VkMemoryPropertyFlags flags = memory_.memoryTypes[i].propertyFlags;
    if ((allowed >> i & 1u) == 0 || (flags & required) != required) continue;
    if ((flags & preferred) == preferred) return i;
    if (found == memory_.memoryTypeCount) found = i;
  }
  if (found == memory_.memoryTypeCount) {
    throw GpuError("memory of a kind that it has not", VK_ERROR_FEATURE_NOT_PRESENT);
  }
  return found;
}

void GpuDevice::wait_until_idle() noexcept {
  const std::lock_guard lock(queue_mutex_);
  vk_.DeviceWaitIdle(device_);  // a lost one is idle
}

void GpuDevice::submit(VkCommandBuffer commands, VkFence fence) {
  VkSubmitInfo info{};
  info.sType = VK_STRUCTURE_TYPE_SUBMIT_INFO;
  info.commandBufferCount = 1;
  info.pCommandBuffers = &commands;
  const std::lock_guard lock(queue_mutex_);
  require_success(vk_.QueueSubmit(queue_, 1, &info, fence), info_.name.c_str());
}

GpuBuffer::GpuBuffer(GpuDevice& device, std::uint64_t bytes, Use use)
    : device_(&device), bytes_(bytes) {
  const VulkanFunctions& vk = device.vk();
  VkBufferCreateInfo info{};
  info.sType = VK_STRUCTURE_TYPE_BUFFER_CREATE_INFO;
  info.size = bytes;
  info.usage = VK_BUFFER_USAGE_STORAGE_BUFFER_BIT | VK_BUFFER_USAGE_TRANSFER_SRC_BIT |
               VK_BUFFER_USAGE_TRANSFER_DST_BIT;
  const char* name = device.info().name.c_str();
  require_success(vk.CreateBuffer(device.handle(), &info, nullptr, &buffer_), name);
  VkMemoryRequirements needs{};
  vk.GetBufferMemoryRequirements(device.handle(), buffer_, &needs);
  constexpr VkMemoryPropertyFlags kVisible =
      VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT | VK_MEMORY_PROPERTY_HOST_COHERENT_BIT;
  VkMemoryAllocateInfo allocate{};
  allocate.sType = VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO;
  allocate.allocationSize = needs.size;
  try {
    allocate.memoryTypeIndex =
        device.memory_type(needs.memoryTypeBits,
                           use == Use::kDevice ? 0 : kVisible,
                           use == Use::kDevice     ? VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT
                           : use == Use::kReadBack ? VK_MEMORY_PROPERTY_HOST_CACHED_BIT
                                                   : 0);
    require_success(vk.AllocateMemory(device.handle(), &allocate, nullptr, &memory_), name);
    require_success(vk.BindBufferMemory(device.handle(), buffer_, memory_, 0), name);
    if (use != Use::kDevice) {
      require_success(vk.MapMemory(device.handle(), memory_, 0, VK_WHOLE_SIZE, 0, &mapped_), name);
    }
  } catch (const GpuError&) {
    *this = GpuBuffer();
    throw;
  }
}

GpuBuffer::~GpuBuffer() {
  if (device_ == nullptr) return;
  const VulkanFunctions& vk = device_->vk();
  vk.DestroyBuffer(device_->handle(), buffer_, nullptr);
  vk.FreeMemory(device_->handle(), memory_, nullptr);
}

GpuBuffer::GpuBuffer(GpuBuffer&& other) noexcept {
  *this = std::move(other);
}

GpuBuffer& GpuBuffer::operator=(GpuBuffer&& other) noexcept {
  std::swap(device_, other.device_);
  std::swap(buffer_, other.buffer_);
  std::swap(memory_, other.memory_);
  std::swap(bytes_, other.bytes_);
  std::swap(mapped_, other.mapped_);
  return *this;
}

}  // namespace pointflight
