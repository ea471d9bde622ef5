#pragma once

#include <array>
#include <cstddef>
#include <map>
#include <optional>

#include "pointflight/map/bvh8.hpp"
#include "pointflight/map/import/internal/cell_tiles.hpp"

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

  /// False where no block is.
  [[nodiscard]] bool any() const;

 private:
  friend class SparseSearch;
  /// Whole numbers; as doubles, because cells of a hostile file may be thousands of kilometres
  /// wide.
  using Key = std::array<double, 3>;
  struct Counts {
    std::size_t all = 0;
    std::size_t sparse = 0;
    [[nodiscard]] bool median_is_sparse() const { return 2 * sparse > all; }
  };
  static Key key_of(double resolution, const VoxelCell& cell);
  [[nodiscard]] bool is_sparse(const Key& key) const;

  std::map<Key, Counts> blocks_;  // of the planar cells
};

/// Which cells lie in sparse blocks, asked for one after another: those of one block are looked up
/// once.
class SparseSearch {
 public:
  /// `blocks` must outlive it.
  explicit SparseSearch(const SparseBlocks& blocks) : blocks_(blocks) {}

  /// True for a cell in one; cells of any width from the same base.
  [[nodiscard]] bool contain(double resolution, const VoxelCell& cell);

 private:
  const SparseBlocks& blocks_;
  std::optional<SparseBlocks::Key> last_;
  bool is_sparse_ = false;
};

}  // namespace pointflight
