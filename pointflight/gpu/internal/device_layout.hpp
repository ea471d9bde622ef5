#pragma once

#include <cstdint>

/// What the kernels and the host share, in the kernels' own words.
namespace pointflight::device {

using uint = std::uint32_t;
#include "pointflight/gpu/kernel/layout.glsl"
#include "pointflight/gpu/kernel/paper_layout.glsl"

}  // namespace pointflight::device
