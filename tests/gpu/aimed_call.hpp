#pragma once

#include <cstring>
#include <vector>

#include "pointflight/gpu/internal/device_aim.hpp"

namespace pointflight::testing {

/// One aim as a device has it in its buffer.
inline std::vector<std::uint32_t> given_of(const KernelMap& map, const AimedBeams& aim) {
  std::vector<std::uint32_t> given(device::kAimWords);
  const auto append = [&](const auto& all) {
    const std::size_t begin = given.size();
    given.resize(begin + all.size() * sizeof all[0] / 4);
    if (!all.empty()) std::memcpy(given.data() + begin, all.data(), all.size() * sizeof all[0]);
    return static_cast<std::uint32_t>(begin);
  };
  const std::uint32_t poses = append(aim.poses);
  const device::DeviceAim own = device_aim(map, aim, poses, append(aim.deviations));
  std::memcpy(given.data(), &own, sizeof own);
  return given;
}

}  // namespace pointflight::testing
