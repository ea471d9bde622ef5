#include "pointflight/gpu/internal/device_upload.hpp"

#include <algorithm>
#include <cstring>
#include <limits>

namespace pointflight {
namespace {

constexpr std::uint64_t kStaging = std::uint64_t{64} << 20;  // bytes

}  // namespace

DeviceUpload::DeviceUpload(GpuDevice& device)
    : device_(device), staging_(device, kStaging, GpuBuffer::Use::kUpload), commands_(device) {}

GpuBuffer DeviceUpload::made_of(const void* data, std::uint64_t bytes, std::uint64_t beyond) {
  GpuBuffer buffer(device_, std::max<std::uint64_t>(bytes + beyond, 256), GpuBuffer::Use::kDevice);
  for (std::uint64_t at = 0; at < bytes; at += kStaging) {
    const std::uint64_t part = std::min(kStaging, bytes - at);
    std::memcpy(
        staging_.as<std::uint8_t>(part).data(), static_cast<const std::uint8_t*>(data) + at, part);
    const VkBufferCopy region{0, at, part};
    device_.vk().CmdCopyBuffer(commands_.begin(), staging_.handle(), buffer.handle(), 1, &region);
    commands_.run(std::numeric_limits<std::uint64_t>::max());
  }
  return buffer;
}

}  // namespace pointflight
