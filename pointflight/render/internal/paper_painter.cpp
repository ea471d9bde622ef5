#include "pointflight/render/internal/paper_painter.hpp"

#include <algorithm>
#include <vector>

namespace pointflight {
namespace {

class ProcessorPainter : public PaperPainter {
 public:
  explicit ProcessorPainter(std::span<const PaperVoxel> voxels) : voxels_(voxels) {}
  void draw(std::span<const std::size_t> seen,
            const Pose& T_sensor_world,
            PaperImage& image,
            const Executor& executor) const override;

 private:
  std::span<const PaperVoxel> voxels_;
};

void ProcessorPainter::draw(std::span<const std::size_t> seen,
                            const Pose& T_sensor_world,
                            PaperImage& image,
                            const Executor& executor) const {
  // Some voxels at a time, so that their points stay in the cache: first every point is projected
  // once, then bands of rows are filled. Each pixel belongs to one band and each band takes the
  // points in the same order, so the result depends on no number of threads.
  const auto threads = static_cast<std::size_t>(executor.threads());
  const std::size_t bands = threads == 1 ? 1 : 4 * threads;
  const std::size_t voxels_a_turn = threads == 1 ? 8 : 64 * threads;
  const Matrix3f turn = T_sensor_world.rotation.toRotationMatrix().cast<float>();
  struct Projected {
    std::vector<PaperSplat> splats;
    int low = 0, high = 0;  // rows, high exclusive
  };
  std::vector<Projected> projected(voxels_a_turn);
  for (std::size_t first = 0; first < seen.size(); first += voxels_a_turn) {
    const std::size_t count = std::min(voxels_a_turn, seen.size() - first);
    executor.parallel_for(count, 1, [&](std::size_t i, std::size_t) {
      const PaperVoxel& voxel = voxels_[seen[first + i]];
      Projected& own = projected[i];
      own.splats.clear();
      const Vector3f corner = (T_sensor_world * voxel.corner_world).cast<float>();
      paper_project(image, voxel.points, corner, turn, own.splats);
      own.low = image.rows;
      own.high = 0;
      for (const PaperSplat& splat : own.splats) {
        own.low = std::min(own.low, std::max(0, splat.first_row));
        own.high = std::max(own.high, std::min(image.rows, splat.last_row + 1));
      }
    });
    // neighbouring voxels fill few rows: those are shared out
    int low = image.rows;
    int high = 0;
    for (std::size_t i = 0; i < count; ++i) {
      low = std::min(low, projected[i].low);
      high = std::max(high, projected[i].high);
    }
    if (low >= high) continue;
    const auto rows = static_cast<std::size_t>(high - low);
    const auto fill_band = [&](std::size_t begin, std::size_t end) {
      const int row_begin = low + static_cast<int>(begin);
      const int row_end = low + static_cast<int>(end);
      for (std::size_t i = 0; i < count; ++i) {
        const Projected& own = projected[i];
        if (own.low < row_end && own.high > row_begin) {
          paper_fill(image, own.splats, row_begin, row_end);
        }
      }
    };
    executor.parallel_for(rows, (rows + bands - 1) / bands, fill_band);
  }
}

}  // namespace

std::unique_ptr<PaperPainter> make_processor_painter(std::span<const PaperVoxel> voxels) {
  return std::make_unique<ProcessorPainter>(voxels);
}

}  // namespace pointflight
