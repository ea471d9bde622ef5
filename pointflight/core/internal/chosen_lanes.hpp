// The lanes of a set one after the other, for all sets of eight.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace pointflight {

/// For each set of lanes, a bit each, eight numbers: those of its lanes, then zeros.
constexpr std::array<std::uint8_t, 256 * 8> chosen_lanes_of_all() {
  std::array<std::uint8_t, 256 * 8> lanes{};
  for (std::size_t set = 0; set < 256; ++set) {
    std::size_t count = 0;
    for (std::size_t lane = 0; lane < 8; ++lane) {
      if ((set >> lane & 1u) != 0) lanes[8 * set + count++] = static_cast<std::uint8_t>(lane);
    }
  }
  return lanes;
}
alignas(64) inline constexpr std::array<std::uint8_t, 256 * 8> kChosenLanes = chosen_lanes_of_all();

}  // namespace pointflight
