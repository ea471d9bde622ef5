#pragma once

#include <cstdint>

#include "pointflight/gpu/internal/device_layout.hpp"
#include "pointflight/render/internal/map_ray.hpp"

namespace pointflight {

/// An aim as kernels read it; where its poses and deviations are is said in words of the buffer.
inline device::DeviceAim device_aim(const KernelMap& map,
                                    const AimedBeams& aim,
                                    std::uint32_t poses,
                                    std::uint32_t deviations) {
  const MapPosition from = map_position(map, aim);
  return {from.axis[0].voxel,
          from.axis[1].voxel,
          from.axis[2].voxel,
          from.axis[0].rest,
          from.axis[1].rest,
          from.axis[2].rest,
          aim.range_max,
          poses,
          aim.poses.size() > 1 ? 1u : 0u,
          aim.deviations.empty() ? device::kNowhere : deviations};
}

}  // namespace pointflight
