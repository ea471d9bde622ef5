#include "pointflight/map/import/internal/small_cells.hpp"

#include "pointflight/core/hash.hpp"
#include "pointflight/map/import/internal/surfel_fit.hpp"

namespace pointflight {
namespace {

constexpr double kEnough = 4.0;  // points per small cell

using SignedVoxel = std::array<std::int32_t, 3>;

/// Voxels by bricks of 4 x 4 x 4: some are wanted, and what lies around those is looked at.
class VoxelSet {
 public:
  struct Brick {
    std::uint64_t key = kNone;
    std::uint64_t wanted = 0;
    std::uint64_t around = 0;
  };

  void add_wanted(const SignedVoxel& voxel) {
    brick_at(voxel).wanted |= bit(voxel);
    for (std::int32_t i = 0; i < 27; ++i) {
      const SignedVoxel near = {
          voxel[0] + i % 3 - 1, voxel[1] + i / 3 % 3 - 1, voxel[2] + i / 9 - 1};
      brick_at(near).around |= bit(near);
    }
  }
  [[nodiscard]] bool is_wanted(const SignedVoxel& voxel) const {
    return (slots_[slot_of(key_of(voxel))].wanted & bit(voxel)) != 0;
  }
  [[nodiscard]] bool is_around(const SignedVoxel& voxel) const {
    return (slots_[slot_of(key_of(voxel))].around & bit(voxel)) != 0;
  }
  [[nodiscard]] bool empty() const { return count_ == 0; }

 private:
  static constexpr std::uint64_t kNone = ~0ull;

  static std::uint64_t key_of(const SignedVoxel& voxel) {
    constexpr std::uint64_t kMask = (1u << 21) - 1;
    const auto part = [](std::int32_t v) { return static_cast<std::uint64_t>(v >> 2) & kMask; };
    return part(voxel[0]) | part(voxel[1]) << 21 | part(voxel[2]) << 42;
  }
  static std::uint64_t bit(const SignedVoxel& voxel) {
    const int place = (voxel[0] & 3) | (voxel[1] & 3) << 2 | (voxel[2] & 3) << 4;
    return std::uint64_t{1} << place;
  }
  [[nodiscard]] std::size_t slot_of(std::uint64_t key) const {
    const std::size_t mask = slots_.size() - 1;
    std::size_t slot = scatter64(key) & mask;
    while (slots_[slot].key != kNone && slots_[slot].key != key) slot = (slot + 1) & mask;
    return slot;
  }
  Brick& brick_at(const SignedVoxel& voxel) {
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

struct SmallCells::Chosen {
  VoxelSet voxels;

  /// Calls `visit(small cells)` for those of each chosen cell that hold enough points; small cells
  /// of one cell lie together.
  template <class Visit>
  void for_each_split(std::span<const VoxelCell> small, const Visit& visit) const {
    for (std::size_t begin = 0, end = 0; begin < small.size(); begin = end) {
      const SignedVoxel voxel = wider_voxel(small[begin].voxel);
      double n = 0.0;
      for (end = begin; end < small.size() && wider_voxel(small[end].voxel) == voxel; ++end) {
        n += small[end].n;
      }
      const std::size_t count = end - begin;
      if (count < 2 || n < kEnough * static_cast<double>(count)) continue;
      if (voxels.is_wanted(voxel)) visit(small.subspan(begin, count));
    }
  }
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
  std::vector<std::size_t> counts(cells.tiles().size(), 0);
  cells.for_each_tile(executor_, [&](std::size_t t, std::span<VoxelCell> own) {
    chosen_->for_each_split(own,
                            [&](std::span<const VoxelCell> split) { counts[t] += split.size(); });
  });
  std::vector<std::size_t> tiles;
  std::vector<std::size_t> first(counts.size() + 1, 0);
  for (std::size_t t = 0; t < counts.size(); ++t) {
    first[t + 1] = first[t] + counts[t];
    if (counts[t] > 0) tiles.push_back(t);
  }
  ScratchArray<SurfelPiece> pieces(scratch_, first.back());
  const auto fit = [&](TileView& view) {
    NeighbourWindow window(view.grid);
    std::size_t to = first[view.tile];
    chosen_->for_each_split(view.own(), [&](std::span<const VoxelCell> split) {
      for (const VoxelCell& cell : split) {
        const SurfelWord word = encode(fit_surfel(view.grid, window, cell));
        const Vector3d center = cells.frame().centroid_world(cell);
        pieces[to++] = {rescaled(word, 0.5f, frame_, center, wider_voxel(cell.voxel)),
                        cell.n,
                        mean_intensity(cell)};
      }
    });
    pieces.release(first[view.tile], to);
  };
  cells.for_each_view_of(tiles, executor_, 1, fit, progress, "fitting small surfels");
  return pieces;
}

}  // namespace pointflight
