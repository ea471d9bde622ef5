#pragma once

#include <memory>
#include <optional>
#include <string>

#include "pointflight/core/input_error.hpp"
#include "pointflight/gpu/internal/gpu_device.hpp"
#include "pointflight/gpu/internal/kernel_pipelines.hpp"

namespace pointflight {

/// The device that `choose_gpu` names, and how it comes to this processor's bits, or as near as may
/// be if these were not asked for.
struct ExactGpu {
  std::shared_ptr<GpuDevice> device;
  RayKernel kernel;
};
/// Throws InputError if there is none or it has other bits, GpuError.
ExactGpu open_exact_gpu();
/// The kernel to use if `exact` is what was found: without one InputError, or a notice and the
/// fastest.
RayKernel kernel_for_use(const GpuDevice& device,
                         const std::optional<RayKernel>& exact,
                         bool may_be_approximate);

/// The same of `open` by a device, whose failures are InputErrors that say what to do without.
/// `instead`: the renderer to use.
template <class Open>
auto open_on_gpu(const char* instead, const Open& open) {
  try {
    return open(open_exact_gpu());
  } catch (const GpuError& error) {
    throw InputError(std::string(error.what()) + "; use --renderer " + instead);
  }
}

/// For `take_gpu_notices`, from any thread.
void add_gpu_notice(const std::string& notice);

}  // namespace pointflight
