// What Vulkan's validation layer says of this process fails its test: ctest asks for the layer.
#include <gtest/gtest.h>

#include "pointflight/gpu/internal/gpu_device.hpp"
#include "tests/gpu/device.hpp"

namespace pointflight {
namespace {

class NothingSaid : public ::testing::Environment {
 public:
  void TearDown() override {
    for (const std::string& message : VulkanFunctions::take_validation_messages()) {
      ADD_FAILURE() << message;
    }
  }
};

const ::testing::Environment* const kNothingSaid =
    ::testing::AddGlobalTestEnvironment(new NothingSaid);

TEST(GpuValidation, IsListenedTo) {
  SKIP_WITHOUT_DEVICE();
  EXPECT_NE(kNothingSaid, nullptr);
  const auto device = GpuDevice::open(find_gpu(""));
  VkBufferCreateInfo info{};
  info.sType = VK_STRUCTURE_TYPE_BUFFER_CREATE_INFO;
  info.size = 16;  // and no use
  VkBuffer buffer = VK_NULL_HANDLE;
  static_cast<void>(device->vk().CreateBuffer(device->handle(), &info, nullptr, &buffer));
  device->vk().DestroyBuffer(device->handle(), buffer, nullptr);
  if (VulkanFunctions::take_validation_messages().empty()) {
    GTEST_SKIP() << "no validation layer, or POINTFLIGHT_VULKAN_VALIDATION is not set";
  }
}

}  // namespace
}  // namespace pointflight
