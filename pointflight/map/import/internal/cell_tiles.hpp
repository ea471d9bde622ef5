#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string_view>
#include <vector>

#include "pointflight/core/parallel.hpp"
#include "pointflight/core/progress.hpp"
#include "pointflight/core/scratch.hpp"
#include "pointflight/map/internal/voxel_moments.hpp"

namespace pointflight {

/// A block of 64 x 64 x 64 voxels and where its cells lie in the array of all cells.
struct CellTile {
  static constexpr int kKeyBits = 18;  ///< Of a voxel's key within its tile.
  static constexpr std::int32_t kWidth = 64;

  std::uint64_t key = 0;  ///< Of its voxels, without their last kKeyBits.
  std::size_t begin = 0;
  std::size_t end = 0;
  [[nodiscard]] std::size_t count() const { return end - begin; }
};

/// A tile with what lies around it: a small grid in which to look for neighbours.
struct TileView {
  std::size_t tile = 0;
  VoxelGrid grid;                   ///< The tile's cells first, in Morton order, then those around.
  std::size_t count = 0;            ///< Of the tile's own cells.
  std::size_t begin = 0;            ///< Index of the tile's first cell in all cells.
  std::vector<std::size_t> around;  ///< Indices of the cells behind the tile's own.

  [[nodiscard]] std::span<const VoxelCell> own() const {
    return std::span(grid.cells()).first(count);
  }
  /// Index in all cells of a cell of the grid.
  [[nodiscard]] std::size_t index_of(std::size_t cell) const {
    return cell < count ? begin + cell : around[cell - count];
  }
};

/// All cells of a map on its way, in Morton order, tile by tile. The stages of an import go over
/// the tiles in parallel, each with a halo of its neighbours' cells, so that neither the cells nor
/// an index of them has to be in memory at once. Between tiles the array may have gaps.
class CellTiles {
 public:
  CellTiles() = default;
  /// `tiles` ascend by key; each tile's cells ascend by voxel_key.
  CellTiles(const VoxelFrame& frame, ScratchArray<VoxelCell> cells, std::vector<CellTile> tiles);

  [[nodiscard]] const VoxelFrame& frame() const { return frame_; }
  [[nodiscard]] double resolution() const { return frame_.resolution; }
  [[nodiscard]] const std::vector<CellTile>& tiles() const { return tiles_; }
  [[nodiscard]] std::span<VoxelCell> cells_of(const CellTile& tile) const {
    return cells_.span().subspan(tile.begin, tile.count());
  }

  /// Occupied cells.
  [[nodiscard]] std::size_t count() const;
  /// Size of the array, gaps included.
  [[nodiscard]] std::size_t capacity() const { return cells_.size(); }
  /// Number of the first cell of each tile if there were no gaps.
  [[nodiscard]] std::vector<std::size_t> first_numbers() const;

  /// The tile with the cells up to `halo` voxels around it (at most a tile's width).
  [[nodiscard]] TileView view(std::size_t tile, std::int32_t halo) const;

  /// Calls `visit` for the views of all tiles, in parallel and in any order.
  void for_each_view(const Executor& executor,
                     std::int32_t halo,
                     const std::function<void(TileView& view)>& visit,
                     const Progress& progress = {},
                     std::string_view what = {}) const;

  /// The same for some tiles, given by ascending number.
  void for_each_view_of(std::span<const std::size_t> tiles,
                        const Executor& executor,
                        std::int32_t halo,
                        const std::function<void(TileView& view)>& visit,
                        const Progress& progress = {},
                        std::string_view what = {}) const;

  /// Calls `visit(tile number, its cells)` for all tiles, in parallel and in any order.
  void for_each_tile(
      const Executor& executor,
      const std::function<void(std::size_t tile, std::span<VoxelCell> cells)>& visit) const;

  /// Keeps the first `counts[i]` cells of each tile.
  void shrink(std::span<const std::size_t> counts);

 private:
  VoxelFrame frame_;
  ScratchArray<VoxelCell> cells_;
  std::vector<CellTile> tiles_;
};

/// Key of the tile of a voxel.
inline std::uint64_t tile_key(const std::array<std::int32_t, 3>& voxel) {
  return voxel_key(voxel) >> CellTile::kKeyBits;
}

}  // namespace pointflight
