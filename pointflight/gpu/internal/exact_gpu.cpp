#include "pointflight/gpu/internal/exact_gpu.hpp"

#include <fmt/format.h>

#include <mutex>
#include <optional>
#include <utility>
#include <vector>

#include "pointflight/gpu/gpu_renderer.hpp"
#include "pointflight/gpu/internal/kernel_choice.hpp"

namespace pointflight {
namespace {

struct Notices {
  std::mutex mutex;
  std::vector<std::string> all;
};
Notices& notices() {
  static Notices own;
  return own;
}

}  // namespace

RayKernel kernel_for_use(const GpuDevice& device,
                         const std::optional<RayKernel>& exact,
                         bool may_be_approximate) {
  if (exact) return *exact;
  const std::string& name = device.info().name;
  if (!may_be_approximate) {
    throw InputError(
        fmt::format("{} does not come to this processor's bits by any way of dividing; use "
                    "--renderer beam, or --gpu approximate for bits of its own",
                    name));
  }
  add_gpu_notice(fmt::format("{} has not this processor's bits: what it renders is its own", name));
  return kernels_for(device).front();
}

ExactGpu open_exact_gpu() {
  const GpuChoice choice = chosen_gpu();
  auto device = GpuDevice::open(find_gpu(choice.index_or_name));
  const RayKernel kernel =
      kernel_for_use(*device, exact_kernel(*device), choice.may_be_approximate);
  return {std::move(device), kernel};
}

void add_gpu_notice(const std::string& notice) {
  const std::lock_guard lock(notices().mutex);
  notices().all.push_back(notice);
}

std::vector<std::string> take_gpu_notices() {
  const std::lock_guard lock(notices().mutex);
  return std::exchange(notices().all, {});
}

}  // namespace pointflight
