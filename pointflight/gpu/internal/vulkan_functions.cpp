#include "pointflight/gpu/internal/vulkan_functions.hpp"

#include <dlfcn.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <type_traits>
#include <vector>

#include "pointflight/core/input_error.hpp"

namespace pointflight {
namespace {

/// The layer that checks how Vulkan is used, if POINTFLIGHT_VULKAN_VALIDATION asks for it.
std::vector<const char*> layers() {
  // NOLINTNEXTLINE(concurrency-mt-unsafe): nothing writes the environment
  if (std::getenv("POINTFLIGHT_VULKAN_VALIDATION") == nullptr) return {};
  return {"VK_LAYER_KHRONOS_validation"};
}

}  // namespace

VulkanFunctions::VulkanFunctions() {
  void* library = dlopen("libvulkan.so.1", RTLD_NOW | RTLD_LOCAL);
  if (library == nullptr) {
    throw InputError(
        "no GPU: libvulkan.so.1 is not installed (Debian: libvulkan1, and the driver)");
  }
  const auto load =
      reinterpret_cast<PFN_vkGetInstanceProcAddr>(dlsym(library, "vkGetInstanceProcAddr"));
  const auto create =
      load == nullptr ? nullptr
                      : reinterpret_cast<PFN_vkCreateInstance>(load(nullptr, "vkCreateInstance"));
  if (create == nullptr) throw InputError("no GPU: libvulkan.so.1 is no Vulkan loader");
  VkApplicationInfo application{};
  application.sType = VK_STRUCTURE_TYPE_APPLICATION_INFO;
  application.pApplicationName = "pointflight";
  application.apiVersion = VK_API_VERSION_1_1;
  const std::vector<const char*> wanted = layers();
  VkInstanceCreateInfo info{};
  info.sType = VK_STRUCTURE_TYPE_INSTANCE_CREATE_INFO;
  info.pApplicationInfo = &application;
  info.enabledLayerCount = static_cast<std::uint32_t>(wanted.size());
  info.ppEnabledLayerNames = wanted.data();
  const VkResult result = create(&info, nullptr, &instance);
  if (result != VK_SUCCESS) {
    throw InputError(fmt::format("no GPU: Vulkan does not start (error {}); is a driver installed?",
                                 static_cast<int>(result)));
  }
  const auto find = [&](const char* name, auto& function) {
    function = reinterpret_cast<std::remove_reference_t<decltype(function)>>(load(instance, name));
    return function != nullptr;
  };
#define POINTFLIGHT_FIND(name) find("vk" #name, name),
  const std::array found = {POINTFLIGHT_VULKAN_FUNCTIONS(POINTFLIGHT_FIND) true};
#undef POINTFLIGHT_FIND
  const bool has_all =
      std::all_of(found.begin(), found.end(), [](bool is_there) { return is_there; });
  if (!has_all) throw InputError("no GPU: the Vulkan loader is older than version 1.1");
}

const VulkanFunctions& VulkanFunctions::get() {
  static VulkanFunctions functions;  // not const: tests let calls fail
  return functions;
}

}  // namespace pointflight
