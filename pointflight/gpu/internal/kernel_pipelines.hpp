#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "pointflight/gpu/internal/device_layout.hpp"
#include "pointflight/gpu/internal/gpu_device.hpp"

namespace pointflight {

/// How a device comes to quotients and roots as IEEE 754 has them (kernel/exact.glsl).
enum class ExactBy { kDevice, kResiduals, kDoubles };

/// A kernel of kernel/rays.comp, and of kernel/wide.comp.
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

/// Invocations of a group, as in the kernels.
inline constexpr std::uint32_t kGroupSize = 128;

/// What a kernel's buffers are bound to.
enum Binding : std::uint32_t {
  kMapNumbers,
  kNodes,
  kWords,
  kGiven,  ///< Rays or aims.
  kResults,
  kCounter,
  kBeams,
  // of wide beams alone
  kTables,
  kCodes,
  kLists,
  kMore,
  kBindings
};

/// Both kernels, made for a device. They are bound alike.
class KernelPipelines {
 public:
  /// The device must outlive it. Throws GpuError.
  KernelPipelines(GpuDevice& device, const RayKernel& kernel);
  ~KernelPipelines();
  KernelPipelines(const KernelPipelines&) = delete;
  KernelPipelines& operator=(const KernelPipelines&) = delete;

  [[nodiscard]] VkDescriptorSetLayout set_layout() const { return set_layout_; }
  [[nodiscard]] VkPipelineLayout layout() const { return layout_; }
  [[nodiscard]] VkPipeline rays() const { return rays_; }
  [[nodiscard]] VkPipeline wide() const { return wide_; }

 private:
  void make(const RayKernel& kernel);
  void make_layout();
  VkPipeline made_of(std::span<const std::uint32_t> code, std::uint32_t most_chunks) const;
  void release() noexcept;

  GpuDevice& device_;
  VkDescriptorSetLayout set_layout_ = VK_NULL_HANDLE;
  VkPipelineLayout layout_ = VK_NULL_HANDLE;
  VkPipeline rays_ = VK_NULL_HANDLE;
  VkPipeline wide_ = VK_NULL_HANDLE;
};

}  // namespace pointflight
