// Places sorted into cubes, for look-ups of what lies near.
#pragma once

#include <array>
#include <cstdint>

#include "pointflight/core/math.hpp"
#include "pointflight/geometry/internal/morton.hpp"
#include "pointflight/geometry/types.hpp"

namespace pointflight {

/// Number of a cube along each axis.
using PlaceCell = std::array<std::int64_t, 3>;

/// The cube of a width that a place lies in, both in m.
inline PlaceCell place_cell(const Vector3d& place, double width) {
  return {floor_to_integer(place.x() / width),
          floor_to_integer(place.y() / width),
          floor_to_integer(place.z() / width)};
}

/// Another number for each cube within 2^20 of the origin's, along each axis.
inline std::uint64_t place_key(const PlaceCell& cell) {
  constexpr std::int64_t kMiddle = 1 << 20;
  return morton_encode(static_cast<std::uint32_t>(cell[0] + kMiddle),
                       static_cast<std::uint32_t>(cell[1] + kMiddle),
                       static_cast<std::uint32_t>(cell[2] + kMiddle));
}

/// Of the 27 cubes around and with a cube: number `i`, 0 to 26.
inline PlaceCell neighbour(const PlaceCell& cell, std::int64_t i) {
  return {cell[0] + i % 3 - 1, cell[1] + i / 3 % 3 - 1, cell[2] + i / 9 - 1};
}

}  // namespace pointflight
