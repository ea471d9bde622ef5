#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "pointflight/gpu/internal/ray_tracer.hpp"
#include "pointflight/render/internal/beam_kernel.hpp"
#include "pointflight/render/internal/cone_kernel.hpp"

namespace pointflight {
namespace {

constexpr std::uint64_t kStaging = std::uint64_t{64} << 20;  // bytes
constexpr std::uint64_t kBeyond = 64;  // bytes behind the words: a leaf may be read as if full

/// Copies bytes to a buffer of the device's own, part by part.
class Uploader {
 public:
  explicit Uploader(GpuDevice& device)
      : device_(device), staging_(device, kStaging, GpuBuffer::Use::kUpload) {
    const VulkanFunctions& vk = device.vk();
    VkCommandPoolCreateInfo pool{};
    pool.sType = VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO;
    pool.flags = VK_COMMAND_POOL_CREATE_RESET_COMMAND_BUFFER_BIT;
    pool.queueFamilyIndex = device.queue_family();
    require_success(vk.CreateCommandPool(device.handle(), &pool, nullptr, &pool_), "upload");
    VkCommandBufferAllocateInfo commands{};
    commands.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO;
    commands.commandPool = pool_;
    commands.commandBufferCount = 1;
    VkFenceCreateInfo fence{};
    fence.sType = VK_STRUCTURE_TYPE_FENCE_CREATE_INFO;
    const bool has_both =
        vk.AllocateCommandBuffers(device.handle(), &commands, &commands_) == VK_SUCCESS &&
        vk.CreateFence(device.handle(), &fence, nullptr, &fence_) == VK_SUCCESS;
    if (!has_both) {
      vk.DestroyCommandPool(device.handle(), pool_, nullptr);
      throw GpuError("upload", VK_ERROR_OUT_OF_HOST_MEMORY);
    }
  }
  ~Uploader() {
    device_.wait_until_idle();
    device_.vk().DestroyFence(device_.handle(), fence_, nullptr);
    device_.vk().DestroyCommandPool(device_.handle(), pool_, nullptr);
  }
  Uploader(const Uploader&) = delete;
  Uploader& operator=(const Uploader&) = delete;

  GpuBuffer made_of(const void* data, std::uint64_t bytes, std::uint64_t beyond) {
    GpuBuffer buffer(
        device_, std::max<std::uint64_t>(bytes + beyond, 256), GpuBuffer::Use::kDevice);
    for (std::uint64_t at = 0; at < bytes; at += kStaging) {
      const std::uint64_t part = std::min(kStaging, bytes - at);
      std::memcpy(staging_.as<std::uint8_t>(part).data(),
                  static_cast<const std::uint8_t*>(data) + at,
                  part);
      copy(buffer, at, part);
    }
    return buffer;
  }

 private:
  void copy(const GpuBuffer& to, std::uint64_t at, std::uint64_t bytes) {
    const VulkanFunctions& vk = device_.vk();
    VkCommandBufferBeginInfo begin{};
    begin.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO;
    begin.flags = VK_COMMAND_BUFFER_USAGE_ONE_TIME_SUBMIT_BIT;
    require_success(vk.BeginCommandBuffer(commands_, &begin), "upload");
    const VkBufferCopy part{0, at, bytes};
    vk.CmdCopyBuffer(commands_, staging_.handle(), to.handle(), 1, &part);
    require_success(vk.EndCommandBuffer(commands_), "upload");
    device_.submit(commands_, fence_);
    constexpr std::uint64_t kLong = std::numeric_limits<std::uint64_t>::max();
    require_success(vk.WaitForFences(device_.handle(), 1, &fence_, VK_TRUE, kLong), "upload");
    require_success(vk.ResetFences(device_.handle(), 1, &fence_), "upload");
  }

  GpuDevice& device_;
  GpuBuffer staging_;
  VkCommandPool pool_ = VK_NULL_HANDLE;
  VkCommandBuffer commands_ = VK_NULL_HANDLE;
  VkFence fence_ = VK_NULL_HANDLE;
};

}  // namespace

device::MapNumbers numbers_of(const SurfelMap& map) {
  const KernelMap kernel = kernel_map_of(map);
  device::MapNumbers n{};
  n.r = kernel.r;
  n.r_squared = kernel.scale.r_squared;
  n.position_step = kernel.scale.position_step;
  n.support_squared = kernel.support_squared;
  n.inverse_support = kernel.inverse_support;
  n.weight_scale = kernel.weight_scale;
  n.window = kernel.window;
  n.shares_per_metre = kShareSteps / kernel.window;
  n.widest2 = kernel.scale.widest[2];
  n.widest3 = kernel.scale.widest[3];
  n.tau = kernel.tau;
  n.node_count = static_cast<std::uint32_t>(kernel.node_count);
  std::copy(std::begin(kernel.scale.inverse_thickness),
            std::end(kernel.scale.inverse_thickness),
            std::begin(n.inverse_thickness));
  std::copy(std::begin(kernel.scale.thickness),
            std::end(kernel.scale.thickness),
            std::begin(n.thickness));
  std::copy(std::begin(kernel.scale.inverse_ratio),
            std::end(kernel.scale.inverse_ratio),
            std::begin(n.inverse_ratio));
  std::copy(std::begin(kernel.scale.ratio), std::end(kernel.scale.ratio), std::begin(n.ratio));
  n.support = kernel.support;
  const ConeConstants cone = cone_constants(kernel);
  n.cone_radius = cone.radius;
  n.solid_support = cone.solid_support;
  n.leaf_reach = cone.leaf_reach;
  n.soft_scale = cone.weight_scale;
  n.soft_tau = cone.tau;
  n.depth_steps_per_metre = cone.depth_steps_per_metre;
  n.metres_per_depth_step = cone.metres_per_depth_step;
  n.has_intensity = map.has_intensity() ? 1 : 0;
  for (std::uint32_t code = 0; code < 32; ++code) {
    n.inverse_spread[code] = 1.0f / std::sqrt(variance2_of(code) * n.r_squared);
  }
  return n;
}

DeviceMap::DeviceMap(GpuDevice& device, const SurfelMap& map) {
  map.verify();
  const std::uint64_t most = device.info().largest_buffer;
  if (map.nodes().size_bytes() > most || map.words().size_bytes() + kBeyond > most) {
    throw GpuError("the map is larger than a buffer of " + device.info().name,
                   VK_ERROR_OUT_OF_DEVICE_MEMORY);
  }
  const device::MapNumbers numbers = numbers_of(map);
  Uploader upload(device);
  numbers_ = upload.made_of(&numbers, sizeof numbers, 0);
  nodes_ = upload.made_of(map.nodes().data(), map.nodes().size_bytes(), 0);
  words_ = upload.made_of(map.words().data(), map.words().size_bytes(), kBeyond);
  codes_ = upload.made_of(map.intensity_codes().data(), map.intensity_codes().size_bytes(), 4);
}

}  // namespace pointflight
