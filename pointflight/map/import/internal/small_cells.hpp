#pragma once

#include <memory>
#include <span>
#include <vector>

#include "pointflight/map/import/internal/cell_accumulator.hpp"
#include "pointflight/map/import/internal/surfel_piece.hpp"

namespace pointflight {

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

  /// True if there is nothing to split: no second pass is wanted.
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
