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

/// A sensor that tumbles through it, each time from another place: beams that leave beside its
/// middle, at different times, with noise.
struct TrialAims {
  std::shared_ptr<const SensorBeams> beams;
  std::vector<AimedBeams> aims;
};
TrialAims trial_aims(std::size_t beams, std::size_t aims);

/// How many of so many rays through the trial's room have the processor's bits by a kernel: a
/// quarter of them are made of beams on the device, and a quarter are wide beams. `there` is the
/// room on the device. Throws GpuError.
std::size_t count_equal(GpuDevice& device,
                        const DeviceMap& there,
                        const RayKernel& kernel,
                        std::size_t rays);

/// The first of `kernels_for` that has the processor's bits of the trial's room; nothing: none has.
/// Throws GpuError.
std::optional<RayKernel> find_exact_kernel(GpuDevice& device);
/// The same, as it was found first in this process.
std::optional<RayKernel> exact_kernel(GpuDevice& device);

}  // namespace pointflight
