#pragma once

#include <memory>
#include <span>

#include "pointflight/gpu/internal/exact_gpu.hpp"
#include "pointflight/render/internal/paper_painter.hpp"

namespace pointflight {

/// One that paints on a device, to the bits of the processor's; if the device is lost the processor
/// paints from there on, and a notice says so. The voxels must outlive it. Throws GpuError.
std::unique_ptr<PaperPainter> make_device_painter(ExactGpu gpu, std::span<const PaperVoxel> voxels);

}  // namespace pointflight
