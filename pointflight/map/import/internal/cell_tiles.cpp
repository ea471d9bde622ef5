#include "pointflight/map/import/internal/cell_tiles.hpp"

#include <algorithm>
#include <numeric>

namespace pointflight {
namespace {

using SignedVoxel = std::array<std::int32_t, 3>;

struct VoxelBox {
  SignedVoxel min;
  SignedVoxel max;  // exclusive
  [[nodiscard]] bool meets(const SignedVoxel& low, std::int32_t width) const {
    bool meets = true;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      meets = meets && low[axis] < max[axis] && low[axis] + width > min[axis];
    }
    return meets;
  }
};

constexpr int kTileBits = CellTile::kKeyBits / 3;

/// Low corner of the aligned cube of 2^bits voxels a side around a voxel.
SignedVoxel corner_of(SignedVoxel voxel, int bits) {
  for (std::int32_t& x : voxel) x = x >> bits << bits;
  return voxel;
}

/// First position from `at` on where `holds` does not, by steps that double: it is mostly near.
template <class Iterator, class Predicate>
Iterator first_behind(Iterator at, Iterator end, const Predicate& holds) {
  std::ptrdiff_t step = 1;
  while (step < end - at && holds(at[step])) {
    at += step;
    step *= 2;
  }
  return std::partition_point(at, at + std::min(step, end - at), holds);
}

SignedVoxel low_voxel(std::uint64_t tile_key) {
  const auto decoded = morton_decode(tile_key);
  SignedVoxel voxel{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    voxel[axis] = static_cast<std::int32_t>(decoded[axis]) * CellTile::kWidth - kMaxVoxel;
  }
  return voxel;
}

}  // namespace

CellTiles::CellTiles(const VoxelFrame& frame,
                     ScratchArray<VoxelCell> cells,
                     std::vector<CellTile> tiles)
    : frame_(frame), cells_(std::move(cells)), tiles_(std::move(tiles)) {}

std::size_t CellTiles::count() const {
  std::size_t count = 0;
  for (const CellTile& tile : tiles_) count += tile.count();
  return count;
}

std::vector<std::size_t> CellTiles::first_numbers() const {
  std::vector<std::size_t> first;
  first.reserve(tiles_.size());
  std::size_t count = 0;
  for (const CellTile& tile : tiles_) {
    first.push_back(count);
    count += tile.count();
  }
  return first;
}

TileView CellTiles::view(std::size_t tile, std::int32_t halo) const {
  const CellTile& middle = tiles_[tile];
  TileView view{tile, VoxelGrid(frame_), middle.count(), middle.begin, {}};
  for (const VoxelCell& cell : cells_of(middle)) view.grid.add(cell);
  const SignedVoxel low = low_voxel(middle.key);
  VoxelBox reach{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    reach.min[axis] = low[axis] - halo;
    reach.max[axis] = low[axis] + CellTile::kWidth + halo;
  }
  const auto add_from = [&](const CellTile& other) {
    const auto cells = cells_of(other);
    for (auto at = cells.begin(); at != cells.end();) {
      if (reach.meets(at->voxel, 1)) {
        view.grid.add(*at);
        view.around.push_back(other.begin + static_cast<std::size_t>(at - cells.begin()));
        ++at;
        continue;
      }
      // over the largest aligned cube of voxels that is out of reach; its cells lie together
      int bits = 1;
      while (bits < kTileBits && !reach.meets(corner_of(at->voxel, bits + 1), 2 << bits)) ++bits;
      const std::uint64_t cube = voxel_key(at->voxel) >> 3 * bits;
      at = first_behind(at, cells.end(), [&](const VoxelCell& cell) {
        return voxel_key(cell.voxel) >> 3 * bits == cube;
      });
    }
  };
  if (halo == 0) return view;
  for (const std::int32_t dx : {-1, 0, 1}) {
    for (const std::int32_t dy : {-1, 0, 1}) {
      for (const std::int32_t dz : {-1, 0, 1}) {
        if (dx == 0 && dy == 0 && dz == 0) continue;
        const SignedVoxel there = {low[0] + dx * CellTile::kWidth,
                                   low[1] + dy * CellTile::kWidth,
                                   low[2] + dz * CellTile::kWidth};
        bool inside = true;
        for (const std::int32_t x : there) inside = inside && x >= -kMaxVoxel && x < kMaxVoxel;
        if (!inside) continue;
        const std::uint64_t key = tile_key(there);
        const auto found = std::lower_bound(
            tiles_.begin(), tiles_.end(), key, [](const CellTile& t, std::uint64_t k) {
              return t.key < k;
            });
        if (found != tiles_.end() && found->key == key) add_from(*found);
      }
    }
  }
  return view;
}

void CellTiles::for_each_view(const Executor& executor,
                              std::int32_t halo,
                              const std::function<void(TileView& view)>& visit,
                              const Progress& progress,
                              std::string_view what) const {
  std::vector<std::size_t> all(tiles_.size());
  std::iota(all.begin(), all.end(), std::size_t{0});
  for_each_view_of(all, executor, halo, visit, progress, what);
}

void CellTiles::for_each_view_of(std::span<const std::size_t> tiles,
                                 const Executor& executor,
                                 std::int32_t halo,
                                 const std::function<void(TileView& view)>& visit,
                                 const Progress& progress,
                                 std::string_view what) const {
  // between batches progress is told (the callback is not for many threads), and pages are given
  // back: earlier, a neighbour would bring them in again
  const std::size_t batch = std::max<std::size_t>(256, tiles.size() / 100);
  for (std::size_t first = 0; first < tiles.size(); first += batch) {
    pointflight::report(
        progress, what, static_cast<double>(first) / static_cast<double>(tiles.size()));
    const std::size_t size = std::min(batch, tiles.size() - first);
    executor.parallel_for(size, 1, [&](std::size_t i, std::size_t) {
      const std::size_t tile = tiles[first + i];
      if (tiles_[tile].count() == 0) return;
      TileView here = view(tile, halo);
      visit(here);
    });
    cells_.release(0, cells_.size());
  }
}

void CellTiles::for_each_tile(
    const Executor& executor,
    const std::function<void(std::size_t tile, std::span<VoxelCell> cells)>& visit) const {
  executor.parallel_for(tiles_.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      visit(i, cells_of(tiles_[i]));
      cells_.release(tiles_[i].begin, tiles_[i].end);
    }
  });
}

void CellTiles::shrink(std::span<const std::size_t> counts) {
  for (std::size_t i = 0; i < tiles_.size(); ++i) tiles_[i].end = tiles_[i].begin + counts[i];
}

}  // namespace pointflight
