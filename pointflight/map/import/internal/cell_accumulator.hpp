#pragma once

#include <array>
#include <span>
#include <vector>

#include "pointflight/io/cloud_reader.hpp"
#include "pointflight/map/import/internal/cell_tiles.hpp"

namespace pointflight {

/// Sorts points into cells, in parallel and in memory that does not grow with the points: cells
/// that exceed the limit go to a scratch array as a sorted run, and runs are merged in the end.
///
/// A cell's sums are those of its points in the order in which they came, whatever the number of
/// threads; only if a run ends, sums of sums are taken.
class CellAccumulator {
 public:
  static constexpr std::size_t kDefaultMemory = std::size_t{1} << 30;  ///< Bytes.

  CellAccumulator(const VoxelFrame& frame,
                  const Executor& executor,
                  Scratch& scratch,
                  std::size_t memory_bytes = kDefaultMemory);

  /// Adds finite points in the world. Returns how many lay out of reach of the frame.
  std::size_t add(std::span<const CloudPoint> points_world);

  /// All cells; the accumulator is empty then.
  CellTiles finish();

 private:
  static constexpr std::size_t kShards = 32;  // tiles are dealt out to them

  /// Points of one chunk of a batch, by shard.
  struct Chunk {
    std::vector<CellPoint> points;
    std::array<std::size_t, kShards + 1> first{};
    std::size_t out_of_reach = 0;
  };

  /// Sorted cells of every shard, one shard behind the other.
  struct Run {
    ScratchArray<VoxelCell> cells;
    std::array<std::size_t, kShards + 1> first{};
    [[nodiscard]] std::span<const VoxelCell> of_shard(std::size_t shard) const {
      return cells.span().subspan(first[shard], first[shard + 1] - first[shard]);
    }
  };

  void sort_points(std::span<const CloudPoint> points, Chunk& chunk) const;
  void end_run();

  VoxelFrame frame_;
  const Executor& executor_;
  Scratch& scratch_;
  std::size_t memory_bytes_;
  std::vector<VoxelGrid> shards_;
  std::vector<Chunk> chunks_;
  std::vector<Run> runs_;
};

}  // namespace pointflight
