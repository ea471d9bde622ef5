// Positions sorted into the cubes of a grid, to look up what is near.
#pragma once

#include <array>
#include <cstdint>

#include "pointflight/core/math.hpp"
#include "pointflight/geometry/internal/morton.hpp"
#include "pointflight/geometry/types.hpp"

namespace pointflight {

/// Number of a cube along each axis.
using GridCell = std::array<std::int64_t, 3>;

/// The cube of a width that a position lies in, both in m.
inline GridCell grid_cell(const Vector3d& position, double width) {
  return {floor_to_integer(position.x() / width),
          floor_to_integer(position.y() / width),
          floor_to_integer(position.z() / width)};
}

/// Another number for each cube within 2^20 of the origin's, along each axis.
inline std::uint64_t grid_key(const GridCell& cell) {
  constexpr std::int64_t kMiddle = 1 << 20;
  return morton_encode(static_cast<std::uint32_t>(cell[0] + kMiddle),
                       static_cast<std::uint32_t>(cell[1] + kMiddle),
                       static_cast<std::uint32_t>(cell[2] + kMiddle));
}

/// Of the 27 cubes around and with a cube: number `i`, 0 to 26.
inline GridCell neighbour(const GridCell& cell, std::int64_t i) {
  return {cell[0] + i % 3 - 1, cell[1] + i / 3 % 3 - 1, cell[2] + i / 9 - 1};
}

}  // namespace pointflight
