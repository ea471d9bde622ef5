#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "pointflight/gpu/internal/device_layout.hpp"
#include "pointflight/gpu/internal/kernel_layout.hpp"

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
  kBindings,
  // of a map in several buffers alone, from the second of each on
  kMoreNodes = kBindings,
  kMoreWords = kMoreNodes + 3,
  kAllBindings = kMoreWords + 7
};

/// Buffers that the sections of a map may lie in (kernel/map.glsl).
///@{
inline constexpr std::size_t kNodeParts = kMoreWords - kMoreNodes + 1;
inline constexpr std::size_t kWordParts = kAllBindings - kMoreWords + 1;
///@}

/// Both kernels, made for a device. They are bound alike.
class KernelPipelines {
 public:
  /// For a map in one buffer a section, or in several. The device must outlive it. Throws GpuError.
  KernelPipelines(GpuDevice& device, const RayKernel& kernel, bool is_split);
  ~KernelPipelines();
  KernelPipelines(const KernelPipelines&) = delete;
  KernelPipelines& operator=(const KernelPipelines&) = delete;

  [[nodiscard]] const KernelLayout& layout() const { return layout_; }
  [[nodiscard]] VkPipeline rays() const { return rays_; }
  [[nodiscard]] VkPipeline wide() const { return wide_; }

 private:
  void release() noexcept;

  GpuDevice& device_;
  KernelLayout layout_;
  VkPipeline rays_ = VK_NULL_HANDLE;
  VkPipeline wide_ = VK_NULL_HANDLE;
};

}  // namespace pointflight
