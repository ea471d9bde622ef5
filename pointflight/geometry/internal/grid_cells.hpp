// Positions sorted into the cubes of a grid, to look up what is near.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <unordered_map>
#include <vector>

#include "pointflight/core/floor.hpp"
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

/// Low corner of a cube, m.
inline Vector3d grid_corner(const GridCell& cell, double width) {
  return width * Vector3d(static_cast<double>(cell[0]),
                          static_cast<double>(cell[1]),
                          static_cast<double>(cell[2]));
}

/// Items at positions, to be found by what they are near to while more are added.
template <class Item>
class GridIndex {
 public:
  /// Of the cubes, m.
  explicit GridIndex(double width) : width_(width) {}

  void add(const Vector3d& position, const Item& item) {
    cells_[grid_cell(position, width_)].push_back(item);
  }

  /// Calls `visit(item)` for those in the position's cube and the 26 around it: all that are nearer
  /// than the width, and others. The order depends on that of adding alone.
  template <class Visit>
  void for_each_around(const Vector3d& position, const Visit& visit) const {
    const GridCell middle = grid_cell(position, width_);
    for (std::int64_t i = 0; i < 27; ++i) {
      const auto found = cells_.find(neighbour(middle, i));
      if (found == cells_.end()) continue;
      for (const Item& item : found->second) visit(item);
    }
  }

 private:
  struct Hash {
    std::size_t operator()(const GridCell& cell) const { return grid_key(cell); }
  };
  double width_;
  std::unordered_map<GridCell, std::vector<Item>, Hash> cells_;
};

}  // namespace pointflight
