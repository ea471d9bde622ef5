#include "pointflight/gpu/internal/vulkan_functions.hpp"

#include <dlfcn.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <mutex>
#include <string_view>
#include <type_traits>
#include <utility>

#include "pointflight/core/input_error.hpp"

namespace pointflight {
namespace {

constexpr const char* kValidation = "VK_LAYER_KHRONOS_validation";

/// True if that layer is wanted and there.
bool validates(PFN_vkGetInstanceProcAddr load) {
  // NOLINTNEXTLINE(concurrency-mt-unsafe): nothing writes the environment
  if (std::getenv("POINTFLIGHT_VULKAN_VALIDATION") == nullptr) return false;
  const auto list = reinterpret_cast<PFN_vkEnumerateInstanceLayerProperties>(
      load(nullptr, "vkEnumerateInstanceLayerProperties"));
  std::uint32_t count = 0;
  if (list == nullptr || list(&count, nullptr) != VK_SUCCESS) return false;
  std::vector<VkLayerProperties> all(count);
  if (list(&count, all.data()) != VK_SUCCESS) return false;
  return std::any_of(all.begin(), all.end(), [](const VkLayerProperties& layer) {
    return std::string_view(layer.layerName) == kValidation;
  });
}

/// What validation said, by any thread.
struct Said {
  std::mutex mutex;
  std::vector<std::string> all;
};
Said& said() {
  static Said own;
  return own;
}

VkBool32 note_message(VkDebugUtilsMessageSeverityFlagBitsEXT /*severity*/,
                      VkDebugUtilsMessageTypeFlagsEXT /*type*/,
                      const VkDebugUtilsMessengerCallbackDataEXT* data,
                      void* /*user*/) {
  const std::lock_guard lock(said().mutex);
  said().all.emplace_back(data->pMessage);
  return VK_FALSE;
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
  const bool is_checked = validates(load);
  const char* const extension = VK_EXT_DEBUG_UTILS_EXTENSION_NAME;
  VkInstanceCreateInfo info{};
  info.sType = VK_STRUCTURE_TYPE_INSTANCE_CREATE_INFO;
  info.pApplicationInfo = &application;
  if (is_checked) {
    info.enabledLayerCount = 1;
    info.ppEnabledLayerNames = &kValidation;
    info.enabledExtensionCount = 1;
    info.ppEnabledExtensionNames = &extension;
  }
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
  if (is_checked) listen_to_validation(load);
}

void VulkanFunctions::listen_to_validation(PFN_vkGetInstanceProcAddr load) const {
  const auto create = reinterpret_cast<PFN_vkCreateDebugUtilsMessengerEXT>(
      load(instance, "vkCreateDebugUtilsMessengerEXT"));
  if (create == nullptr) return;
  VkDebugUtilsMessengerCreateInfoEXT info{};
  info.sType = VK_STRUCTURE_TYPE_DEBUG_UTILS_MESSENGER_CREATE_INFO_EXT;
  info.messageSeverity = VK_DEBUG_UTILS_MESSAGE_SEVERITY_WARNING_BIT_EXT |
                         VK_DEBUG_UTILS_MESSAGE_SEVERITY_ERROR_BIT_EXT;
  info.messageType = VK_DEBUG_UTILS_MESSAGE_TYPE_VALIDATION_BIT_EXT;
  info.pfnUserCallback = note_message;
  VkDebugUtilsMessengerEXT messenger = VK_NULL_HANDLE;  // as long as the instance, which stays
  static_cast<void>(create(instance, &info, nullptr, &messenger));
}

std::vector<std::string> VulkanFunctions::take_validation_messages() {
  const std::lock_guard lock(said().mutex);
  return std::exchange(said().all, {});
}

const VulkanFunctions& VulkanFunctions::get() {
  static VulkanFunctions functions;  // not const: tests let calls fail
  return functions;
}

}  // namespace pointflight
