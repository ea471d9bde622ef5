#pragma once

#include <vector>

#include "pointflight/gpu/internal/vulkan_functions.hpp"

namespace pointflight {

/// All devices, in the order of `list_gpus`. Throws InputError if there is none.
std::vector<VkPhysicalDevice> physical_devices(const VulkanFunctions& vk);

}  // namespace pointflight
