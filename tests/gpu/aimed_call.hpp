#pragma once

#include <cstring>
#include <vector>

#include "pointflight/gpu/internal/device_layout.hpp"
#include "pointflight/render/internal/map_ray.hpp"

namespace pointflight::testing {

/// One aim as a device has it in its buffer.
inline std::vector<std::uint32_t> given_of(const KernelMap& map, const AimedBeams& aim) {
  std::vector<std::uint32_t> given(device::kAimWords);
  const auto append = [&](const auto& all) {
    const std::size_t begin = given.size();
    given.resize(begin + all.size() * sizeof all[0] / 4);
    std::memcpy(given.data() + begin, all.data(), all.size() * sizeof all[0]);
    return static_cast<std::uint32_t>(begin);
  };
  const MapPosition from = map_position(map, aim);
  const std::uint32_t poses = append(aim.poses);
  const device::DeviceAim own{from.axis[0].voxel,
                              from.axis[1].voxel,
                              from.axis[2].voxel,
                              from.axis[0].rest,
                              from.axis[1].rest,
                              from.axis[2].rest,
                              aim.range_max,
                              poses,
                              aim.poses.size() > 1 ? 1u : 0u,
                              aim.deviations.empty() ? device::kNowhere : append(aim.deviations)};
  std::memcpy(given.data(), &own, sizeof own);
  return given;
}

}  // namespace pointflight::testing
