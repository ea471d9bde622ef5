#include "pointflight/map/import/internal/sparse_blocks.hpp"

#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

namespace pointflight {
namespace {

constexpr double kBlock = 3.0;  // m

}  // namespace

SparseBlocks::Key SparseBlocks::key_of(double resolution, const VoxelCell& cell) {
  Key key{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    key[axis] = std::floor(cell.voxel[axis] * resolution / kBlock);
  }
  return key;
}

SparseBlocks::SparseBlocks(const CellTiles& cells,
                           const ScratchArray<BuildSurfel>& surfels,
                           const Executor& executor) {
  const std::vector<std::size_t> first = cells.first_numbers();
  std::vector<std::map<Key, Counts>> of_tile(cells.tiles().size());
  cells.for_each_tile(executor, [&](std::size_t t, std::span<VoxelCell> own) {
    Key last{};
    Counts* counts = nullptr;
    for (std::size_t i = 0; i < own.size(); ++i) {
      if (!is_planar(surfels[first[t] + i].word)) continue;
      const Key key = key_of(cells.resolution(), own[i]);
      if (counts == nullptr || key != last) counts = &of_tile[t][key];
      last = key;
      ++counts->all;
      counts->sparse += own[i].n < kSparsePoints ? 1 : 0;
    }
    surfels.release(first[t], first[t] + own.size());
  });
  for (const auto& blocks : of_tile) {
    for (const auto& [key, counts] : blocks) {
      blocks_[key].all += counts.all;
      blocks_[key].sparse += counts.sparse;
    }
  }
}

bool SparseBlocks::is_sparse(const Key& key) const {
  const auto block = blocks_.find(key);
  return block != blocks_.end() && block->second.median_is_sparse();
}

bool SparseSearch::contain(double resolution, const VoxelCell& cell) {
  const SparseBlocks::Key key = SparseBlocks::key_of(resolution, cell);
  if (last_ != key) {
    last_ = key;
    is_sparse_ = blocks_.is_sparse(key);
  }
  return is_sparse_;
}

bool SparseBlocks::any() const {
  return std::any_of(blocks_.begin(), blocks_.end(), [](const auto& block) {
    return block.second.median_is_sparse();
  });
}

}  // namespace pointflight
