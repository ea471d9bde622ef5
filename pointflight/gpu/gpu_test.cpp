#include "pointflight/gpu/gpu_test.hpp"

#include <chrono>
#include <numeric>
#include <optional>
#include <vector>

#include "pointflight/core/input_error.hpp"
#include "pointflight/gpu/internal/kernel_choice.hpp"
#include "pointflight/render/internal/beam_kernel.hpp"

namespace pointflight {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::size_t kCompared = std::size_t{1} << 17;  // rays
constexpr double kLongEnough = 0.4;                      // s

/// How often a second `action` can be done; at least once.
template <class Action>
double rate_of(const Action& action) {
  action();  // once for what is made at first
  const auto begin = Clock::now();
  double count = 0.0;
  double seconds = 0.0;
  while (seconds < kLongEnough) {
    action();
    count += 1.0;
    seconds = std::chrono::duration<double>(Clock::now() - begin).count();
  }
  return count / seconds;
}

GpuTest tested(GpuDevice& device, const Executor& executor) {
  GpuTest test;
  test.rays = kCompared;
  const std::optional<RayKernel> exact = exact_kernel(device);
  const RayKernel kernel = exact.value_or(kernels_for(device).front());
  if (exact) test.exact_by = name_of(*exact);
  test.equal = count_equal(device, kernel, kCompared);

  const auto map = trial_scene();
  const std::vector<Ray> rays = trial_rays(kCompared);
  std::vector<std::uint32_t> order(rays.size());
  std::iota(order.begin(), order.end(), 0u);
  const DeviceMap there(device, *map);
  RayTracer tracer(device, there, kernel);
  const auto count = static_cast<double>(rays.size());
  test.speed = count * rate_of([&] {
                 pack_rays(*map, rays, order, tracer.rays(0, rays.size()));
                 tracer.submit(0, rays.size());
                 static_cast<void>(tracer.collect(0));
               });
  std::vector<KernelHit> hits(rays.size());
  const KernelMap own = kernel_map_of(*map);
  test.processor_speed =
      count * rate_of([&] {
        executor.parallel_for(order.size(), 1024, [&](std::size_t begin, std::size_t end) {
          trace_beams(own, rays, std::span(order).subspan(begin, end - begin), hits);
        });
      });
  return test;
}

}  // namespace

GpuTest test_gpu(const std::string& index_or_name, const Executor& executor) {
  const GpuInfo info = find_gpu(index_or_name);
  try {
    return tested(*GpuDevice::open(info), executor);
  } catch (const GpuError& error) {
    throw InputError(error.what());
  }
}

}  // namespace pointflight
