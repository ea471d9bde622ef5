// One size of cells does not suit a whole map: where points are thin on a flat surface a wide cell
// holds enough of them, and where many lie on something that is not flat small cells show its form.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "pointflight/map/bvh8.hpp"
#include "pointflight/map/cell_accumulator.hpp"
#include "pointflight/map/sparse_blocks.hpp"

namespace pointflight {

/// A surfel that stands for a wide or a small cell.
struct SurfelPiece {
  BuildSurfel surfel;           ///< By the map's own voxels.
  std::uint32_t n = 0;          ///< Points.
  float mean_intensity = 0.0f;  ///< Of the points.
};

/// Mean intensity of a cell's points; 0 where it is not finite.
float mean_intensity(const VoxelCell& cell);

/// The same points in cells twice as wide.
CellTiles wider_cells(const CellTiles& cells, const Executor& executor, Scratch& scratch);

/// Wide cells instead of thin ones: where a cell two to eight times as wide, up to 0.45 m, is
/// planar with 4 points or more and the cells half as wide in it have fewer than 3 on average, in
/// sparse blocks. Sets `covered` for the cells that lie in one (by their number). The pieces come
/// in Morton order. Does not depend on threads.
ScratchArray<SurfelPiece> surfels_of_wide_cells(const CellTiles& cells,
                                                const SparseBlocks& sparse,
                                                std::vector<bool>& covered,
                                                const Executor& executor,
                                                Scratch& scratch,
                                                const Progress& progress = {});

/// Small cells, half as wide, instead of those that are not planar and hold enough points: 4 on
/// average in each that is occupied. Takes a second pass over the points.
class SmallCells {
 public:
  /// Chooses the cells to split by their surfels, in the same order. Both are only looked at here.
  SmallCells(const CellTiles& cells,
             const ScratchArray<BuildSurfel>& surfels,
             const std::vector<bool>& covered,
             const Executor& executor,
             Scratch& scratch,
             std::size_t memory_bytes);
  ~SmallCells();

  /// True where there is nothing to split: no second pass is wanted.
  [[nodiscard]] bool empty() const;
  /// Points of the second pass, in the world.
  void add(std::span<const CloudPoint> points_world);
  /// The pieces in Morton order, those of one cell together.
  ScratchArray<SurfelPiece> finish(const Progress& progress = {});

 private:
  struct Chosen;
  VoxelFrame frame_;
  const Executor& executor_;
  Scratch& scratch_;
  std::unique_ptr<Chosen> chosen_;
  CellAccumulator small_;
  std::vector<CloudPoint> kept_;
};

}  // namespace pointflight
