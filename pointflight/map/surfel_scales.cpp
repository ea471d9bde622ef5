#include "pointflight/map/surfel_scales.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>

#include "pointflight/core/hash.hpp"
#include "pointflight/map/surfel_fit.hpp"

namespace pointflight {
namespace {

constexpr double kWidest = 0.45;        // m, of wide cells
constexpr int kDoublingsMax = 3;        // wider ones are more than a surfel's 1.8 r
constexpr std::uint32_t kPlane = 4;     // points of a wide cell
constexpr double kThin = 3.5;           // points per cell
constexpr double kThinAround = 16.0;    // points per wide cell
constexpr double kEnough = 4.0;         // points per small cell
constexpr float kLeastVolume = 0.035f;  // r: s0 that is not rounded to a planar surfel's
constexpr float kWidestSpread = 1.8f;   // r
constexpr double kSurface = 6.0;        // occupied cells in 3 x 3 x 3 where a surface goes on

using Voxel = std::array<std::int32_t, 3>;

Voxel halved(const Voxel& v) {
  return {v[0] >> 1, v[1] >> 1, v[2] >> 1};
}

/// A cell in the one twice as wide that it lies in.
VoxelCell in_wider(const VoxelCell& cell, double resolution) {
  Vector3d shift;  // to the wide cell's centre
  for (int axis = 0; axis < 3; ++axis) {
    const bool upper = (cell.voxel[static_cast<std::size_t>(axis)] & 1) != 0;
    shift[axis] = (upper ? -0.5 : 0.5) * resolution;
  }
  const Moments moments = cell.moments().about(shift);
  VoxelCell wide;
  wide.voxel = halved(cell.voxel);
  wide.n = cell.n;
  wide.intensity_sum = cell.intensity_sum;
  std::size_t k = 0;
  for (int row = 0; row < 3; ++row) {
    wide.sum[static_cast<std::size_t>(row)] = static_cast<float>(moments.sum[row]);
    for (int column = row; column < 3; ++column) {
      wide.products[k++] = static_cast<float>(moments.products(row, column));
    }
  }
  return wide;
}

/// The surfel of a cell that is `factor` times as wide as the map's, in a voxel of the map.
BuildSurfel rescaled(SurfelWord word,
                     float factor,
                     const VoxelFrame& map,
                     const Vector3d& center,
                     const Voxel& voxel) {
  Surfel surfel = decode(word);
  const bool planar = is_planar(word);
  surfel.s *= factor;
  surfel.s[0] = planar ? kPlanarThickness : std::max(surfel.s[0], kLeastVolume);
  for (const int k : {1, 2}) surfel.s[k] = std::clamp(surfel.s[k], kMinSpread, kWidestSpread);
  const Vector3d at = (center - map.base_world) / map.resolution;
  for (int axis = 0; axis < 3; ++axis) {
    const double low = voxel[static_cast<std::size_t>(axis)];
    surfel.center_voxels[axis] = std::clamp(static_cast<float>(at[axis] - low), 0.0f, 0.999f);
  }
  return {voxel_key(voxel), encode(surfel)};
}

/// Cells of one width, their surfels, and how many cells half as wide each has.
struct Level {
  CellTiles cells;
  ScratchArray<BuildSurfel> surfels;
  std::vector<std::uint8_t> children;
  std::vector<std::uint8_t> lies_in_thin;
};

/// True for cells around which points are thin: a cell that has few because a surface ends in it is
/// no reason for a wide one.
std::vector<std::uint8_t> look_around(const CellTiles& cells, const Executor& executor) {
  std::vector<std::uint8_t> thin(cells.count(), 0);
  const std::vector<std::size_t> first = cells.first_numbers();
  cells.for_each_view(executor, 1, [&](TileView& view) {
    NeighbourWindow window(view.grid);
    std::size_t to = first[view.tile];
    for (const VoxelCell& cell : view.own()) {
      double n = 0.0;
      double occupied = 0.0;
      window.for_each(cell, 1, [&](const VoxelCell& other, int, int, int) {
        n += other.n;
        occupied += 1.0;
      });
      thin[to++] = n < kThinAround * occupied && occupied >= kSurface ? 1 : 0;
    }
  });
  return thin;
}

/// Calls `visit(number of the cell, number of its wide cell)`; both sorts lie in Morton order.
template <class Visit>
void for_each_child(const CellTiles& cells, const Visit& visit) {
  std::size_t number = 0;
  std::size_t wide = 0;
  std::optional<Voxel> last;
  for (const CellTile& tile : cells.tiles()) {
    for (const VoxelCell& cell : cells.cells_of(tile)) {
      const Voxel voxel = halved(cell.voxel);
      if (last && *last != voxel) ++wide;
      last = voxel;
      visit(number++, wide);
    }
  }
}

/// Voxels by bricks of 4 x 4 x 4: some are wanted, and what lies around those is looked at.
class VoxelSet {
 public:
  struct Brick {
    std::uint64_t key = kNone;
    std::uint64_t wanted = 0;
    std::uint64_t around = 0;
  };

  void add_wanted(const Voxel& voxel) {
    brick_at(voxel).wanted |= bit(voxel);
    for (std::int32_t i = 0; i < 27; ++i) {
      const Voxel near = {voxel[0] + i % 3 - 1, voxel[1] + i / 3 % 3 - 1, voxel[2] + i / 9 - 1};
      brick_at(near).around |= bit(near);
    }
  }
  [[nodiscard]] bool is_wanted(const Voxel& voxel) const {
    return (slots_[slot_of(key_of(voxel))].wanted & bit(voxel)) != 0;
  }
  [[nodiscard]] bool is_around(const Voxel& voxel) const {
    return (slots_[slot_of(key_of(voxel))].around & bit(voxel)) != 0;
  }
  [[nodiscard]] bool empty() const { return count_ == 0; }

 private:
  static constexpr std::uint64_t kNone = ~0ull;

  static std::uint64_t key_of(const Voxel& voxel) {
    constexpr std::uint64_t kMask = (1u << 21) - 1;
    const auto part = [](std::int32_t v) { return static_cast<std::uint64_t>(v >> 2) & kMask; };
    return part(voxel[0]) | part(voxel[1]) << 21 | part(voxel[2]) << 42;
  }
  static std::uint64_t bit(const Voxel& voxel) {
    const int place = (voxel[0] & 3) | (voxel[1] & 3) << 2 | (voxel[2] & 3) << 4;
    return std::uint64_t{1} << place;
  }
  [[nodiscard]] std::size_t slot_of(std::uint64_t key) const {
    const std::size_t mask = slots_.size() - 1;
    std::size_t slot = scatter64(key) & mask;
    while (slots_[slot].key != kNone && slots_[slot].key != key) slot = (slot + 1) & mask;
    return slot;
  }
  Brick& brick_at(const Voxel& voxel) {
    const std::uint64_t key = key_of(voxel);
    std::size_t slot = slot_of(key);
    if (slots_[slot].key == kNone) {
      if (2 * ++count_ > slots_.size()) {
        std::vector<Brick> old(2 * slots_.size());
        std::swap(old, slots_);
        for (const Brick& brick : old) {
          if (brick.key != kNone) slots_[slot_of(brick.key)] = brick;
        }
        slot = slot_of(key);
      }
      slots_[slot].key = key;
    }
    return slots_[slot];
  }

  std::vector<Brick> slots_ = std::vector<Brick>(1 << 10);
  std::size_t count_ = 0;
};

}  // namespace

float mean_intensity(const VoxelCell& cell) {
  const float mean = cell.intensity_sum / static_cast<float>(cell.n);
  return std::isfinite(mean) ? mean : 0.0f;
}

CellTiles wider_cells(const CellTiles& cells, const Executor& executor, Scratch& scratch) {
  const VoxelFrame frame{cells.frame().base_world, 2.0 * cells.resolution()};
  // a tile's cells make whole wide cells, for its width is even
  std::vector<std::size_t> counts(cells.tiles().size(), 0);
  cells.for_each_tile(executor, [&](std::size_t t, std::span<VoxelCell> own) {
    for (std::size_t i = 0; i < own.size(); ++i) {
      counts[t] += i == 0 || halved(own[i].voxel) != halved(own[i - 1].voxel) ? 1 : 0;
    }
  });
  std::vector<std::size_t> first(counts.size() + 1, 0);
  std::partial_sum(counts.begin(), counts.end(), first.begin() + 1);
  ScratchArray<VoxelCell> wide(scratch, first.back());
  cells.for_each_tile(executor, [&](std::size_t t, std::span<VoxelCell> own) {
    std::size_t to = first[t];
    for (std::size_t i = 0; i < own.size(); ++i) {
      const VoxelCell cell = in_wider(own[i], cells.resolution());
      if (i > 0 && wide[to - 1].voxel == cell.voxel) {
        wide[to - 1].add(cell);
      } else {
        wide[to++] = cell;
      }
    }
    wide.release(first[t], to);
  });
  std::vector<CellTile> tiles;
  for (std::size_t t = 0; t < counts.size(); ++t) {
    if (counts[t] == 0) continue;
    const std::uint64_t key = tile_key(wide[first[t]].voxel);
    if (tiles.empty() || tiles.back().key != key) tiles.push_back({key, first[t], first[t]});
    tiles.back().end = first[t + 1];
  }
  return {frame, std::move(wide), std::move(tiles)};
}

ScratchArray<SurfelPiece> surfels_of_wide_cells(const CellTiles& cells,
                                                const SparseBlocks& sparse,
                                                std::vector<bool>& covered,
                                                const Executor& executor,
                                                Scratch& scratch,
                                                const Progress& progress) {
  std::vector<Level> levels;
  const auto below = [&](std::size_t level) -> const CellTiles& {
    return level == 0 ? cells : levels[level - 1].cells;
  };
  if (!sparse.any()) {
    covered.assign(cells.count(), false);
    return ScratchArray<SurfelPiece>(scratch, 0);
  }
  for (int i = 0; i < kDoublingsMax && below(levels.size()).resolution() <= 0.5 * kWidest; ++i) {
    Level level;
    level.cells = wider_cells(below(levels.size()), executor, scratch);
    level.surfels = fit_surfels(level.cells, executor, scratch, progress);
    level.children.assign(level.cells.count(), 0);
    for_each_child(below(levels.size()),
                   [&](std::size_t, std::size_t wide) { ++level.children[wide]; });
    level.lies_in_thin = look_around(level.cells, executor);
    levels.push_back(std::move(level));
  }
  // from the widest down: one that is taken covers what lies in it
  std::vector<SurfelPiece> pieces;
  std::vector<bool> taken(levels.empty() ? 0 : levels.back().cells.count(), false);
  for (std::size_t l = levels.size(); l-- > 0;) {
    const Level& level = levels[l];
    const auto factor = static_cast<float>(level.cells.resolution() / cells.resolution());
    std::size_t number = 0;
    for (const CellTile& tile : level.cells.tiles()) {
      for (const VoxelCell& cell : level.cells.cells_of(tile)) {
        const std::size_t i = number++;
        if (taken[i] || cell.n < kPlane || cell.n >= kThin * level.children[i]) continue;
        if (level.lies_in_thin[i] == 0 || !sparse.contain(level.cells.resolution(), cell)) continue;
        const SurfelWord word = level.surfels[i].word;
        if (!is_planar(word)) continue;
        const Vector3d center = level.cells.frame().centroid_world(cell);
        const auto place = cells.frame().place_of(center);
        if (!place) continue;
        taken[i] = true;
        pieces.push_back({rescaled(word, factor, cells.frame(), center, place->voxel),
                          cell.n,
                          mean_intensity(cell)});
      }
    }
    std::vector<bool> inside(below(l).count(), false);
    for_each_child(below(l),
                   [&](std::size_t child, std::size_t wide) { inside[child] = taken[wide]; });
    taken = std::move(inside);
  }
  covered = std::move(taken);
  covered.resize(cells.count(), false);
  std::sort(pieces.begin(), pieces.end(), [](const SurfelPiece& a, const SurfelPiece& b) {
    return a.surfel.morton < b.surfel.morton;
  });
  ScratchArray<SurfelPiece> result(scratch, pieces.size());
  std::copy(pieces.begin(), pieces.end(), result.begin());
  return result;
}

struct SmallCells::Chosen {
  VoxelSet voxels;
};

SmallCells::SmallCells(const CellTiles& cells,
                       const ScratchArray<BuildSurfel>& surfels,
                       const std::vector<bool>& covered,
                       const Executor& executor,
                       Scratch& scratch,
                       std::size_t memory_bytes)
    : frame_(cells.frame()),
      executor_(executor),
      scratch_(scratch),
      chosen_(std::make_unique<Chosen>()),
      small_({frame_.base_world, 0.5 * frame_.resolution}, executor, scratch, memory_bytes) {
  std::size_t number = 0;
  for (const CellTile& tile : cells.tiles()) {
    for (const VoxelCell& cell : cells.cells_of(tile)) {
      const std::size_t i = number++;
      // two small cells at least
      if (covered[i] || is_planar(surfels[i].word) || cell.n < 2.0 * kEnough) continue;
      chosen_->voxels.add_wanted(cell.voxel);
    }
  }
}

SmallCells::~SmallCells() = default;

bool SmallCells::empty() const {
  return chosen_->voxels.empty();
}

void SmallCells::add(std::span<const CloudPoint> points_world) {
  kept_.clear();
  for (const CloudPoint& point : points_world) {
    const auto place = frame_.place_of(point.position);
    if (place && chosen_->voxels.is_around(place->voxel)) kept_.push_back(point);
  }
  small_.add(kept_);
}

ScratchArray<SurfelPiece> SmallCells::finish(const Progress& progress) {
  const CellTiles cells = small_.finish();
  const ScratchArray<BuildSurfel> surfels = fit_surfels(cells, executor_, scratch_, progress);
  ScratchArray<SurfelPiece> pieces(scratch_, cells.count());
  std::size_t size = 0;
  std::size_t number = 0;
  for (const CellTile& tile : cells.tiles()) {
    const auto own = cells.cells_of(tile);
    for (std::size_t begin = 0, end = 0; begin < own.size(); begin = end) {
      // the small cells of one cell lie together
      const Voxel voxel = halved(own[begin].voxel);
      double n = 0.0;
      for (end = begin; end < own.size() && halved(own[end].voxel) == voxel; ++end) n += own[end].n;
      const std::size_t count = end - begin;
      if (count < 2 || n < kEnough * static_cast<double>(count)) continue;
      if (!chosen_->voxels.is_wanted(voxel)) continue;
      for (std::size_t i = begin; i < end; ++i) {
        const Vector3d center = cells.frame().centroid_world(own[i]);
        pieces[size++] = {rescaled(surfels[number + i].word, 0.5f, frame_, center, voxel),
                          own[i].n,
                          mean_intensity(own[i])};
      }
    }
    number += own.size();
  }
  ScratchArray<SurfelPiece> result(scratch_, size);
  std::copy(pieces.begin(), pieces.begin() + size, result.begin());
  return result;
}

}  // namespace pointflight
