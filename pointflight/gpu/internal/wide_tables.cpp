#include "pointflight/gpu/internal/wide_tables.hpp"

#include <bit>

#include "pointflight/gpu/internal/device_layout.hpp"
#include "pointflight/render/internal/sub_rays.hpp"

namespace pointflight {

std::vector<std::uint32_t> wide_tables(const SurfelMap& map, const Reflectances& reflectances) {
  std::vector<std::uint32_t> words(device::kTableWords);
  const auto set = [&](std::size_t word, float value) {
    words[word] = std::bit_cast<std::uint32_t>(value);
  };
  const std::size_t turns = (device::kAtEight - device::kAtTurns) / 2;
  for (std::size_t i = 0; i < turns; ++i) {
    const Turn turn = turn_of(i);
    set(device::kAtTurns + 2 * i, turn.cosine);
    set(device::kAtTurns + 2 * i + 1, turn.sine);
  }
  const SubRayLanes& eight = first_sub_rays();
  float squares[8];
  for (std::size_t i = 0; i < 8; ++i) {
    set(device::kAtEight + 2 * i, eight.x[i]);
    set(device::kAtEight + 2 * i + 1, eight.y[i]);
    set(device::kAtShares + i, eight.share[i]);
    squares[i] = eight.x[i] * eight.x[i];
    set(device::kAtStrips + 2 * i, strip_directions().x[i]);
    set(device::kAtStrips + 2 * i + 1, strip_directions().y[i]);
  }
  // in the order of `sum` (core/internal/simd8-inl.hpp)
  set(device::kAtPerXx,
      1.0f / (((squares[0] + squares[1]) + (squares[2] + squares[3])) +
              ((squares[4] + squares[5]) + (squares[6] + squares[7]))));
  for (std::size_t k = 0; k < kStripDirections; ++k) {
    const std::vector<SubRayLanes>& second = sub_rays_of_level(1, k);
    for (std::size_t i = 0; i < device::kSecondLevel; ++i) {
      const std::size_t at = device::kAtSecond + 2 * (device::kSecondLevel * k + i);
      set(at, second[i / 8].x[i % 8]);
      set(at + 1, second[i / 8].y[i % 8]);
    }
  }
  for (std::size_t code = 0; code < 256; ++code) {
    set(device::kAtLevels + code, map.intensity_levels().of_code[code]);
  }
  for (std::size_t i = 0; reflectances.usual != nullptr && i < 4096; ++i) {
    set(device::kAtUsual + i, reflectances.usual[i]);
  }
  return words;
}

}  // namespace pointflight
