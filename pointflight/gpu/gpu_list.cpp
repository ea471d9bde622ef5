#include "pointflight/gpu/gpu_list.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <mutex>

#include "pointflight/core/input_error.hpp"
#include "pointflight/gpu/internal/physical_devices.hpp"

namespace pointflight {
namespace {

std::string version_of(std::uint32_t version) {
  return fmt::format("{}.{}.{}",
                     VK_API_VERSION_MAJOR(version),
                     VK_API_VERSION_MINOR(version),
                     VK_API_VERSION_PATCH(version));
}

GpuInfo info_of(const VulkanFunctions& vk, VkPhysicalDevice device, std::size_t index) {
  VkPhysicalDeviceDriverProperties driver{};
  driver.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_DRIVER_PROPERTIES;
  VkPhysicalDeviceSubgroupProperties subgroup{};
  subgroup.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_SUBGROUP_PROPERTIES;
  subgroup.pNext = &driver;
  VkPhysicalDeviceProperties2 all{};
  all.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PROPERTIES_2;
  all.pNext = &subgroup;
  vk.GetPhysicalDeviceProperties2(device, &all);
  VkPhysicalDeviceFeatures features{};
  vk.GetPhysicalDeviceFeatures(device, &features);
  VkPhysicalDeviceMemoryProperties memory{};
  vk.GetPhysicalDeviceMemoryProperties(device, &memory);
  GpuInfo info;
  info.index = index;
  info.name = static_cast<const char*>(all.properties.deviceName);
  info.driver = fmt::format("{} {}",
                            static_cast<const char*>(driver.driverName),
                            static_cast<const char*>(driver.driverInfo));
  info.api = version_of(all.properties.apiVersion);
  for (std::uint32_t i = 0; i < memory.memoryHeapCount; ++i) {
    const bool is_own = (memory.memoryHeaps[i].flags & VK_MEMORY_HEAP_DEVICE_LOCAL_BIT) != 0;
    if (is_own) info.memory = std::max<std::uint64_t>(info.memory, memory.memoryHeaps[i].size);
  }
  info.largest_buffer = all.properties.limits.maxStorageBufferRange;
  info.subgroup = subgroup.subgroupSize;
  info.has_doubles = features.shaderFloat64 == VK_TRUE;
  info.is_processor = all.properties.deviceType == VK_PHYSICAL_DEVICE_TYPE_CPU;
  return info;
}

std::string in_words(const std::vector<GpuInfo>& gpus) {
  std::string words;
  for (const GpuInfo& gpu : gpus) {
    words += fmt::format("{}{} {}", words.empty() ? "" : ", ", gpu.index, gpu.name);
  }
  return words;
}

/// What was chosen, by any thread.
struct Choice {
  std::mutex mutex;
  GpuChoice gpu;
};
Choice& last_choice() {
  static Choice all;
  return all;
}

GpuChoice read_choice(const std::string& text) {
  const std::string approximate = "approximate";
  if (text == approximate) return {"", true};
  if (text.ends_with("," + approximate)) {
    return {text.substr(0, text.size() - approximate.size() - 1), true};
  }
  return {text, false};
}

}  // namespace

std::vector<VkPhysicalDevice> physical_devices(const VulkanFunctions& vk) {
  std::uint32_t count = 0;
  vk.EnumeratePhysicalDevices(vk.instance, &count, nullptr);
  std::vector<VkPhysicalDevice> devices(count);
  vk.EnumeratePhysicalDevices(vk.instance, &count, devices.data());
  devices.resize(count);
  if (devices.empty()) {
    throw InputError(
        "no GPU: Vulkan has no device; is its driver installed (Mesa: "
        "mesa-vulkan-drivers, NVIDIA: nvidia-vulkan-icd)?");
  }
  return devices;
}

std::vector<GpuInfo> list_gpus() {
  const VulkanFunctions& vk = VulkanFunctions::get();
  std::vector<GpuInfo> gpus;
  for (VkPhysicalDevice device : physical_devices(vk)) {
    gpus.push_back(info_of(vk, device, gpus.size()));
  }
  return gpus;
}

GpuInfo find_gpu(const std::string& index_or_name) {
  const std::vector<GpuInfo> gpus = list_gpus();
  if (index_or_name.empty()) {
    const auto own = std::find_if(
        gpus.begin(), gpus.end(), [](const GpuInfo& gpu) { return !gpu.is_processor; });
    return own != gpus.end() ? *own : gpus.front();
  }
  std::size_t index = 0;
  const char* end = index_or_name.data() + index_or_name.size();
  const auto read = std::from_chars(index_or_name.data(), end, index);
  if (read.ec == std::errc() && read.ptr == end && index < gpus.size()) return gpus[index];
  for (const GpuInfo& gpu : gpus) {
    if (gpu.name.find(index_or_name) != std::string::npos) return gpu;
  }
  throw InputError(fmt::format("no GPU '{}'; there are: {}", index_or_name, in_words(gpus)));
}

void choose_gpu(const std::string& choice) {
  const GpuChoice gpu = read_choice(choice);
  find_gpu(gpu.index_or_name);
  const std::lock_guard lock(last_choice().mutex);
  last_choice().gpu = gpu;
}

GpuChoice chosen_gpu() {
  const std::lock_guard lock(last_choice().mutex);
  return last_choice().gpu;
}

}  // namespace pointflight
