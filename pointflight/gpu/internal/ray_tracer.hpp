#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "pointflight/gpu/internal/device_layout.hpp"
#include "pointflight/gpu/internal/gpu_device.hpp"
#include "pointflight/map/surfel_map.hpp"
#include "pointflight/render/internal/map_ray.hpp"

namespace pointflight {

/// How a device comes to quotients and roots as IEEE 754 has them (kernel/exact.glsl).
enum class ExactBy { kDevice, kResiduals, kDoubles };

/// A kernel of kernel/rays.comp.
struct RayKernel {
  ExactBy exact = ExactBy::kResiduals;
  /// Subgroups stay and take ray after ray; else an invocation a ray.
  bool is_persistent = false;
  /// A subgroup of the former takes rays so many times; 0: as long as there are any. llvmpipe ends
  /// a shader after 65,535 turns of its loops.
  std::uint32_t most_chunks = 0;
};

/// In a word or two, for users.
std::string name_of(const RayKernel& kernel);
/// Those that a device may run, the fastest first.
std::vector<RayKernel> kernels_for(const GpuDevice& device);

/// What a kernel needs of a map beside nodes and words.
device::MapNumbers numbers_of(const SurfelMap& map);

/// A map in a device's memory.
class DeviceMap {
 public:
  /// Throws GpuError if it does not fit, InputError if the map is damaged: kernels read what nodes
  /// say without a look.
  DeviceMap(GpuDevice& device, const SurfelMap& map);

  /// Numbers, nodes and words, as the kernel binds them.
  [[nodiscard]] const std::array<GpuBuffer, 3>& buffers() const { return buffers_; }

 private:
  std::array<GpuBuffer, 3> buffers_;
};

/// Aims of the same beams that go to a device together.
struct AimedPart {
  std::shared_ptr<const SensorBeams> beams;
  std::vector<const AimedBeams*> aims;
  bool wants_ranges = false;  ///< And no more of each hit.
};

/// Rays through a map on a device. What is on its way lies in slots, so that the host fills one and
/// reads another meanwhile. For one thread at a time.
class RayTracer {
 public:
  static constexpr std::size_t kSlots = 3;
  static constexpr std::size_t kMostRays = std::size_t{1} << 20;   ///< That are given to a slot.
  static constexpr std::size_t kMostBeams = std::size_t{1} << 22;  ///< Of a slot.

  /// Device and map must outlive it. Throws GpuError.
  RayTracer(GpuDevice& device, const DeviceMap& map, const RayKernel& kernel);
  /// Waits for what is on its way.
  ~RayTracer();
  RayTracer(const RayTracer&) = delete;
  RayTracer& operator=(const RayTracer&) = delete;

  /// Room for the rays of a slot that is not on its way.
  [[nodiscard]] std::span<MapRay> rays(std::size_t slot, std::size_t count);
  /// Sends the first `count` of them off. Throws GpuError.
  void submit(std::size_t slot, std::size_t count);
  /// Sends aims off, whose rays the device makes. Throws GpuError.
  void submit(std::size_t slot, const KernelMap& map, const AimedPart& part);
  /// Waits for what is on its way. Throws GpuError.
  void wait(std::size_t slot);
  /// What was hit, when it is no longer on its way, until the slot is filled again: of each ray, or
  /// of each beam of each aim.
  [[nodiscard]] std::span<const device::DeviceHit> hits(std::size_t slot) const;
  /// The same where ranges are wanted, m: `Hit::range`, or kTooMany.
  [[nodiscard]] std::span<const float> ranges(std::size_t slot) const;
  /// How long the kernel of the last `wait` took, s.
  [[nodiscard]] double kernel_time() const { return kernel_time_; }
  /// So many beams are best sent at a time: what the device traces in a tenth of a second, as far
  /// as that is known.
  [[nodiscard]] std::size_t beams_at_once() const { return beams_at_once_; }
  /// A slot for beams, or null for rays, of those that are free: one that has them already, or the
  /// one that was used least recently. At least one must be free.
  [[nodiscard]] std::size_t slot_for(const SensorBeams* beams,
                                     const std::function<bool(std::size_t slot)>& is_free) const;

 private:
  struct Slot {
    GpuBuffer upload, given, beams, results, read_back;
    std::shared_ptr<const SensorBeams> has_beams;  ///< In `beams`.
    VkDescriptorSet set = VK_NULL_HANDLE;
    VkCommandBuffer commands = VK_NULL_HANDLE;
    VkFence fence = VK_NULL_HANDLE;
    device::DeviceCall call{};  ///< On its way.
    std::uint64_t used = 0;     ///< Number of the call.
  };
  /// What a slot has to have room for, bytes.
  struct Needs {
    std::uint64_t given, beams, results;
  };
  void make_pipeline(const RayKernel& kernel);
  void make_slots();
  void make_room(Slot& slot, const Needs& needs);
  void bind(Slot& slot);
  void send(Slot& slot, std::uint64_t given, std::uint64_t beams);
  void record(Slot& slot, std::uint64_t given, std::uint64_t beams);
  void release() noexcept;

  GpuDevice& device_;
  const DeviceMap& map_;
  RayKernel kernel_;
  VkDescriptorSetLayout set_layout_ = VK_NULL_HANDLE;
  VkPipelineLayout layout_ = VK_NULL_HANDLE;
  VkPipeline pipeline_ = VK_NULL_HANDLE;
  VkDescriptorPool descriptors_ = VK_NULL_HANDLE;
  VkCommandPool pool_ = VK_NULL_HANDLE;
  VkQueryPool queries_ = VK_NULL_HANDLE;
  GpuBuffer counter_;
  std::array<Slot, kSlots> slots_;
  double kernel_time_ = 0.0;
  std::size_t beams_at_once_ = kMostRays;
  std::uint64_t calls_ = 0;
};

}  // namespace pointflight
