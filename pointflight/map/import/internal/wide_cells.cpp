#include "pointflight/map/import/internal/wide_cells.hpp"

#include <algorithm>
#include <numeric>
#include <optional>

#include "pointflight/map/import/internal/surfel_fit.hpp"

namespace pointflight {
namespace {

constexpr double kWidestCell = 0.45;   // m
constexpr int kDoublingsMax = 3;       // wider ones are more than a surfel's 1.8 r
constexpr std::uint32_t kPlane = 4;    // points of a wide cell
constexpr double kThin = 3.5;          // points per cell
constexpr double kOnePlane = 0.005;    // r, standard deviation across it
constexpr double kNoisyPlane = 0.02;   // r, the same if points are noisier
constexpr double kMergedPoints = 4.0;  // points per cell
constexpr double kThinAround = 16.0;   // points per wide cell
constexpr double kSurface = 6.0;       // occupied cells in 3 x 3 x 3 if a surface goes on

using Voxel = std::array<std::int32_t, 3>;

/// A cell in the one twice as wide that it lies in.
VoxelCell in_wider(const VoxelCell& cell, double resolution) {
  Vector3d shift;  // to the wide cell's centre
  for (int axis = 0; axis < 3; ++axis) {
    const bool upper = (cell.voxel[static_cast<std::size_t>(axis)] & 1) != 0;
    shift[axis] = (upper ? -0.5 : 0.5) * resolution;
  }
  const Moments moments = cell.moments().about(shift);
  VoxelCell wide;
  wide.voxel = wider_voxel(cell.voxel);
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

/// Surfel of a wide cell that may stand for the cells in it, by the number of that cell.
struct Candidate {
  std::size_t number = 0;
  bool is_thin = true;  ///< Else one plane's.
  SurfelPiece piece;
};

/// Cells of one width, how many cells half as wide each has, and which of them are flat and thin.
struct Level {
  CellTiles cells;
  std::vector<std::uint8_t> children;
  std::vector<std::uint8_t> planar;    ///< Of them; empty if planes are not looked for.
  ScratchArray<Candidate> candidates;  ///< Those of a tile from `first` on; the tiles ascend.
  struct OfTile {
    std::size_t tile, first, count;
  };
  std::vector<OfTile> of_tile;
};

/// Calls `visit(number of the cell, number of its wide cell)`; both sorts lie in Morton order.
template <class Visit>
void for_each_child(const CellTiles& cells, const Visit& visit) {
  std::size_t number = 0;
  std::size_t wide = 0;
  std::optional<Voxel> last;
  for (const CellTile& tile : cells.tiles()) {
    for (const VoxelCell& cell : cells.cells_of(tile)) {
      const Voxel voxel = wider_voxel(cell.voxel);
      if (last && *last != voxel) ++wide;
      last = voxel;
      visit(number++, wide);
    }
  }
}

/// True for a cell with enough points for a plane and few for its width, in a sparse block.
bool is_thin(const VoxelCell& cell,
             std::uint8_t children,
             double resolution,
             SparseSearch& sparse) {
  return cell.n >= kPlane && cell.n < kThin * children && sparse.contain(resolution, cell);
}

/// True for cells around which points are thin: a cell that has few because a surface ends in it is
/// no reason for a wide one.
bool lies_in_thin(NeighbourWindow& window, const VoxelCell& cell) {
  double n = 0.0;
  double occupied = 0.0;
  window.for_each(cell, 1, [&](const VoxelCell& other, int, int, int) {
    n += other.n;
    occupied += 1.0;
  });
  return n < kThinAround * occupied && occupied >= kSurface;
}

/// True for a cell with enough points for its width, all in planar cells.
bool may_lie_amid_plane(const Level& level,
                        std::size_t number,
                        const VoxelCell& cell,
                        SparseSearch& sparse) {
  return !level.planar.empty() && level.planar[number] == level.children[number] &&
         cell.n >= kMergedPoints * level.children[number] &&
         !sparse.contain(level.cells.resolution(), cell);
}

/// Room for the candidates of each tile that may have any.
void make_room(Level& level,
               const SparseBlocks& sparse,
               const Executor& executor,
               Scratch& scratch) {
  const std::vector<std::size_t> first = level.cells.first_numbers();
  const double resolution = level.cells.resolution();
  std::vector<std::size_t> thin(level.cells.tiles().size(), 0);
  level.cells.for_each_tile(executor, [&](std::size_t t, std::span<VoxelCell> own) {
    SparseSearch search(sparse);
    for (std::size_t i = 0; i < own.size(); ++i) {
      const std::size_t number = first[t] + i;
      thin[t] += is_thin(own[i], level.children[number], resolution, search) ||
                         may_lie_amid_plane(level, number, own[i], search)
                     ? 1
                     : 0;
    }
  });
  std::size_t room = 0;
  for (std::size_t t = 0; t < thin.size(); ++t) {
    if (thin[t] > 0) level.of_tile.push_back({t, room, 0});
    room += thin[t];
  }
  level.candidates = ScratchArray<Candidate>(scratch, room);
}

/// Fits surfels to the cells that points are thin in and around. Only those that are planar are
/// kept, in voxels of the map.
void find_candidates(Level& level,
                     const SparseBlocks& sparse,
                     const VoxelFrame& map,
                     double noise,
                     const Executor& executor,
                     const Progress& progress) {
  const std::vector<std::size_t> first = level.cells.first_numbers();
  const double resolution = level.cells.resolution();
  const auto factor = static_cast<float>(resolution / map.resolution);
  // a form that noise hides anyway may be lost
  const double thickness =
      map.resolution * std::clamp(0.25 * noise / map.resolution, kOnePlane, kNoisyPlane);
  std::vector<std::size_t> tiles;
  for (const Level::OfTile& tile : level.of_tile) tiles.push_back(tile.tile);
  const auto visit = [&](TileView& view) {
    auto& of_tile = *std::lower_bound(
        level.of_tile.begin(),
        level.of_tile.end(),
        view.tile,
        [](const Level::OfTile& tile, std::size_t number) { return tile.tile < number; });
    SparseSearch search(sparse);
    NeighbourWindow window(view.grid);
    std::size_t number = first[view.tile];
    for (const VoxelCell& cell : view.own()) {
      const std::size_t i = number++;
      const bool thin = is_thin(cell, level.children[i], resolution, search);
      if (thin ? !lies_in_thin(window, cell)
               : !may_lie_amid_plane(level, i, cell, search) ||
                     !lies_amid_plane(view.grid, window, cell, thickness)) {
        continue;
      }
      const SurfelWord word = encode(fit_surfel(view.grid, window, cell));
      if (!is_planar(word)) continue;
      const Vector3d center = level.cells.frame().centroid_world(cell);
      const auto place = map.place_of(center);
      if (!place) continue;
      // merged ones are as dense as what they stand for
      const std::uint32_t n = thin ? cell.n : cell.n / level.children[i];
      level.candidates[of_tile.first + of_tile.count++] = {
          i, thin, {rescaled(word, factor, map, center, place->voxel), n, mean_intensity(cell)}};
    }
  };
  level.cells.for_each_view_of(tiles, executor, 1, visit, progress, "fitting wide surfels");
}

}  // namespace

CellTiles wider_cells(const CellTiles& cells, const Executor& executor, Scratch& scratch) {
  const VoxelFrame frame{cells.frame().base_world, 2.0 * cells.resolution()};
  // a tile's cells make whole wide cells, for its width is even
  std::vector<std::size_t> counts(cells.tiles().size(), 0);
  cells.for_each_tile(executor, [&](std::size_t t, std::span<VoxelCell> own) {
    for (std::size_t i = 0; i < own.size(); ++i) {
      counts[t] += i == 0 || wider_voxel(own[i].voxel) != wider_voxel(own[i - 1].voxel) ? 1 : 0;
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

WideSurfels surfels_of_wide_cells(const CellTiles& cells,
                                  const ScratchArray<BuildSurfel>& surfels,
                                  const SparseBlocks& sparse,
                                  double noise,
                                  const Executor& executor,
                                  Scratch& scratch,
                                  const Progress& progress) {
  std::vector<Level> levels;
  const auto below = [&](std::size_t level) -> const CellTiles& {
    return level == 0 ? cells : levels[level - 1].cells;
  };
  std::size_t most = 0;
  const int doublings = sparse.any() ? kDoublingsMax : 1;  // planes are merged once
  for (int i = 0; i < doublings && below(levels.size()).resolution() <= 0.5 * kWidestCell; ++i) {
    Level level;
    level.cells = wider_cells(below(levels.size()), executor, scratch);
    level.children.assign(level.cells.count(), 0);
    if (i == 0) level.planar.assign(level.cells.count(), 0);
    for_each_child(below(levels.size()), [&](std::size_t child, std::size_t wide) {
      ++level.children[wide];
      if (i == 0 && is_planar(surfels[child].word)) ++level.planar[wide];
    });
    make_room(level, sparse, executor, scratch);
    find_candidates(level, sparse, cells.frame(), noise, executor, progress);
    for (const Level::OfTile& tile : level.of_tile) most += tile.count;
    levels.push_back(std::move(level));
  }
  // from the widest down: one that is taken covers what lies in it
  WideSurfels wide;
  wide.pieces = ScratchArray<SurfelPiece>(scratch, most);
  std::vector<bool> taken(levels.empty() ? 0 : levels.back().cells.count(), false);
  for (std::size_t l = levels.size(); l-- > 0;) {
    for (const Level::OfTile& tile : levels[l].of_tile) {
      for (const Candidate& candidate :
           levels[l].candidates.span().subspan(tile.first, tile.count)) {
        if (taken[candidate.number]) continue;
        taken[candidate.number] = true;
        wide.pieces[wide.thin + wide.merged] = candidate.piece;
        ++(candidate.is_thin ? wide.thin : wide.merged);
      }
    }
    std::vector<bool> inside(below(l).count(), false);
    for_each_child(below(l),
                   [&](std::size_t child, std::size_t cell) { inside[child] = taken[cell]; });
    taken = std::move(inside);
  }
  wide.covered = std::move(taken);
  wide.covered.resize(cells.count(), false);
  const std::size_t size = wide.thin + wide.merged;
  std::sort(
      wide.pieces.begin(),
      wide.pieces.begin() + size,
      [](const SurfelPiece& a, const SurfelPiece& b) { return a.surfel.morton < b.surfel.morton; });
  wide.pieces.shrink(size);
  return wide;
}

}  // namespace pointflight
