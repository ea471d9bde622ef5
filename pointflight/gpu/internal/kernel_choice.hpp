#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <vector>

#include "pointflight/gpu/internal/ray_tracer.hpp"
#include "pointflight/render/renderer.hpp"

namespace pointflight {

/// A room with pillars, railings and a slope, some 30,000 surfels: what devices are tried on.
std::shared_ptr<const SurfelMap> trial_scene();
/// Rays from anywhere in it.
std::vector<Ray> trial_rays(std::size_t count);

/// The rays as a device takes them, in this order.
void pack_rays(const SurfelMap& map,
               std::span<const Ray> rays,
               std::span<const std::uint32_t> order,
               std::span<device::DeviceRay> packed);

/// How many of the trial's rays have the processor's bits by a kernel. Throws GpuError.
std::size_t count_equal(GpuDevice& device, const RayKernel& kernel, std::size_t rays);

/// The first of `kernels_for` that has the processor's bits of a scene of its own, as it was found
/// once in this process; nothing: none has. Throws GpuError.
std::optional<RayKernel> exact_kernel(GpuDevice& device);

}  // namespace pointflight
