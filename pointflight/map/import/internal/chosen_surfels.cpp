#include "pointflight/map/import/internal/chosen_surfels.hpp"

#include <algorithm>

namespace pointflight {
namespace {

constexpr std::uint64_t kEnd = ~0ull;

/// The pieces of a list from the front, by their voxels.
class Queue {
 public:
  explicit Queue(std::span<const SurfelPiece> pieces) : left_(pieces) {}
  [[nodiscard]] std::uint64_t key() const {
    return left_.empty() ? kEnd : left_.front().surfel.morton;
  }
  const SurfelPiece& take() {
    const SurfelPiece& piece = left_.front();
    left_ = left_.subspan(1);
    return piece;
  }

 private:
  std::span<const SurfelPiece> left_;
};

/// Calls `visit(piece)` for all that is chosen, in Morton order.
template <class Visit>
void for_each_chosen(const CellTiles& cells,
                     const ScratchArray<BuildSurfel>& of_cells,
                     const std::vector<bool>& covered,
                     const ScratchArray<SurfelPiece>& wide,
                     const ScratchArray<SurfelPiece>& small,
                     const Visit& visit) {
  Queue wide_left(wide.span());
  Queue small_left(small.span());
  std::size_t number = 0;
  for (const CellTile& tile : cells.tiles()) {
    const std::size_t first = number;
    for (const VoxelCell& cell : cells.cells_of(tile)) {
      const std::size_t i = number++;
      const std::uint64_t key = voxel_key(cell.voxel);
      while (wide_left.key() < key) visit(wide_left.take());
      if (covered[i]) continue;
      if (small_left.key() != key) {
        visit(SurfelPiece{of_cells[i], cell.n, mean_intensity(cell)});
      }
      while (small_left.key() == key) visit(small_left.take());
    }
    of_cells.release(first, number);
  }
  while (wide_left.key() != kEnd) visit(wide_left.take());
}

}  // namespace

ChosenSurfels choose_surfels(const CellTiles& cells,
                             const ScratchArray<BuildSurfel>& of_cells,
                             const std::vector<bool>& covered,
                             const ScratchArray<SurfelPiece>& wide,
                             const ScratchArray<SurfelPiece>& small,
                             bool has_intensity,
                             Scratch& scratch) {
  constexpr std::size_t kMostPoints = 1 << 12;
  std::vector<std::uint64_t> planar_with(kMostPoints + 1, 0);
  ChosenSurfels chosen;
  std::size_t count = 0;
  IntensityHistogram intensities;
  const auto for_each = [&](const auto& visit) {
    for_each_chosen(cells, of_cells, covered, wide, small, visit);
  };
  for_each([&](const SurfelPiece& piece) {
    ++count;
    if (has_intensity) intensities.add(piece.mean_intensity);
    if (!is_planar(piece.surfel.word)) return;
    ++chosen.planar;
    ++planar_with[std::min<std::size_t>(piece.n, kMostPoints)];
  });
  std::uint64_t below = 0;
  for (std::size_t n = 0; n <= kMostPoints && chosen.planar > 0; ++n) {
    below += planar_with[n];
    if (below <= chosen.planar / 2) continue;
    chosen.points_per_planar = static_cast<double>(n);
    break;
  }
  chosen.surfels = ScratchArray<BuildSurfel>(scratch, count);
  if (has_intensity) {
    chosen.levels = intensities.levels();
    chosen.intensity = ScratchArray<std::uint8_t>(scratch, count);
  }
  std::size_t at = 0;
  for_each([&](const SurfelPiece& piece) {
    if (has_intensity) chosen.intensity[at] = chosen.levels.code_of(piece.mean_intensity);
    chosen.surfels[at++] = piece.surfel;
  });
  return chosen;
}

}  // namespace pointflight
