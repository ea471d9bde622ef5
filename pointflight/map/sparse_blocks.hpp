#pragma once

#include <array>
#include <cstddef>
#include <map>

#include "pointflight/map/bvh8.hpp"
#include "pointflight/map/cell_tiles.hpp"

namespace pointflight {

/// A cell with fewer is sparse.
inline constexpr double kSparsePoints = 4.0;

/// Where a scan is thin: blocks of 3 m whose median planar cell has fewer than 4 points. A cell
/// that has few because a surface ends in it does not make a region sparse.
class SparseBlocks {
 public:
  /// `surfels` are those of `cells`, in their order. Does not depend on threads.
  SparseBlocks(const CellTiles& cells,
               const ScratchArray<BuildSurfel>& surfels,
               const Executor& executor);

  /// True for a cell in one; cells of any width from the same base.
  [[nodiscard]] bool contain(double resolution, const VoxelCell& cell) const;
  /// False where no block is.
  [[nodiscard]] bool any() const;

 private:
  /// Whole numbers; as doubles, because cells of a hostile file may be thousands of kilometres
  /// wide.
  using Key = std::array<double, 3>;
  struct Counts {
    std::size_t all = 0;
    std::size_t sparse = 0;
    [[nodiscard]] bool median_is_sparse() const { return 2 * sparse > all; }
  };
  static Key key_of(double resolution, const VoxelCell& cell);

  std::map<Key, Counts> blocks_;  // of the planar cells
};

}  // namespace pointflight
