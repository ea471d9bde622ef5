#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "pointflight/gpu/internal/kernel_pipelines.hpp"
#include "pointflight/map/surfel_map.hpp"
#include "pointflight/render/internal/cone_kernel.hpp"
#include "pointflight/render/internal/map_ray.hpp"

namespace pointflight {

/// What a kernel needs of a map beside nodes and words.
device::MapNumbers numbers_of(const SurfelMap& map);

/// A map in a device's memory.
class DeviceMap {
 public:
  /// In buffers of at most so many bytes; a section may take several. Throws GpuError if it does
  /// not fit, InputError if the map is damaged: kernels read what nodes say without a look.
  DeviceMap(GpuDevice& device, const SurfelMap& map, std::uint64_t largest_buffer);
  /// In the largest that the device has.
  DeviceMap(GpuDevice& device, const SurfelMap& map)
      : DeviceMap(device, map, device.info().largest_buffer) {}

  /// True if a section lies in several buffers.
  [[nodiscard]] bool is_split() const { return nodes_.size() > 1 || words_.size() > 1; }
  /// As kernels bind them.
  ///@{
  [[nodiscard]] const GpuBuffer& numbers() const { return numbers_; }
  [[nodiscard]] const std::vector<GpuBuffer>& nodes() const { return nodes_; }
  [[nodiscard]] const std::vector<GpuBuffer>& words() const { return words_; }
  [[nodiscard]] const GpuBuffer& codes() const { return codes_; }
  ///@}

 private:
  GpuBuffer numbers_;
  std::vector<GpuBuffer> nodes_, words_;
  GpuBuffer codes_;  ///< Of intensities.
};

/// Aims of the same beams that go to a device together.
struct AimedPart {
  std::shared_ptr<const SensorBeams> beams;
  std::vector<const AimedBeams*> aims;
  bool wants_ranges = false;  ///< And no more of each hit.
};

/// The same of wide beams of one sensor.
struct WidePart {
  AimedPart aimed;
  float sigma_across = 0.0f;  ///< `WideBeams`
  float sigma_up = 0.0f;
  Reflectances reflectances;
  std::vector<std::uint32_t> tables;  ///< `wide_tables`
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
  /// The same of wide beams, `wide_at_once` at most.
  void submit(std::size_t slot, const KernelMap& map, const WidePart& part);
  /// Waits for what is on its way. Throws GpuError.
  void wait(std::size_t slot);
  /// What was hit, when it is no longer on its way, until the slot is filled again: of each ray, or
  /// of each beam of each aim.
  [[nodiscard]] std::span<const device::DeviceHit> hits(std::size_t slot) const;
  /// The same where ranges are wanted, m: `Hit::range`, or kTooMany.
  [[nodiscard]] std::span<const float> ranges(std::size_t slot) const;
  /// The same of wide beams.
  [[nodiscard]] std::span<const device::WideResult> wide_results(std::size_t slot) const;
  /// False if one of them, which is of kMoreSubRays, says what cannot be.
  [[nodiscard]] bool has_second_level(std::size_t slot, const device::WideResult& result) const;
  /// What the second level's sub-rays hit of it.
  [[nodiscard]] SecondLevel second_level(std::size_t slot, const device::WideResult& result) const;
  /// How long the kernel of the last `wait` took, s.
  [[nodiscard]] double kernel_time() const { return kernel_time_; }
  /// So many beams are best sent at a time: what the device traces in a tenth of a second, as far
  /// as that is known.
  [[nodiscard]] std::size_t beams_at_once() const { return beams_at_once_; }
  /// So many wide beams go at a time.
  [[nodiscard]] std::size_t wide_at_once() const;
  /// A slot for beams, or null for rays, of those that are free: one that has them already, or the
  /// one that was used least recently. At least one must be free.
  [[nodiscard]] std::size_t slot_for(const SensorBeams* beams,
                                     const std::function<bool(std::size_t slot)>& is_free) const;

 private:
  /// Bytes of a slot's buffers that a call takes.
  struct Needs {
    std::uint64_t given = 0, tables = 0, beams = 0, results = 0, more = 0, lists = 0;
  };
  struct Slot {
    GpuBuffer upload, given, tables, beams, results, more, read_back;
    std::shared_ptr<const SensorBeams> has_beams;  ///< In `beams`.
    VkDescriptorSet set = VK_NULL_HANDLE;
    VkCommandBuffer commands = VK_NULL_HANDLE;
    VkFence fence = VK_NULL_HANDLE;
    device::DeviceCall call{};  ///< On its way.
    Needs sent;                 ///< With it.
    std::uint64_t used = 0;     ///< Number of the call.
  };
  void make_slots();
  void make_room(Slot& slot, const Needs& needs);
  void bind(Slot& slot);
  Needs take_aims(Slot& slot,
                  const KernelMap& map,
                  const AimedPart& part,
                  std::span<const std::uint32_t> tables,
                  Needs needs);
  [[nodiscard]] std::uint32_t wide_threads(std::size_t beams) const;
  void send(Slot& slot, const Needs& needs);
  void record(Slot& slot);
  void dispatch(const Slot& slot, const device::DeviceCall& call, std::uint32_t groups) const;
  void dispatch_wide(const Slot& slot) const;
  void release() noexcept;

  GpuDevice& device_;
  const DeviceMap& map_;
  RayKernel kernel_;
  KernelPipelines pipelines_;
  VkDescriptorPool descriptors_ = VK_NULL_HANDLE;
  VkCommandPool pool_ = VK_NULL_HANDLE;
  VkQueryPool queries_ = VK_NULL_HANDLE;
  GpuBuffer counter_;
  GpuBuffer lists_;  ///< Of wide beams: calls follow each other.
  std::array<Slot, kSlots> slots_;
  double kernel_time_ = 0.0;
  std::size_t beams_at_once_ = kMostRays;
  std::uint64_t calls_ = 0;
};

}  // namespace pointflight
