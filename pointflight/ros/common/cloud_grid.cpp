#include "pointflight/ros/common/cloud_grid.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "pointflight/core/input_error.hpp"
#include "pointflight/lidar/beam_pattern.hpp"

namespace pointflight {

CloudGrid::CloudGrid(const LidarSettings& settings) {
  if (settings.pattern == ScanPattern::kGrid) {
    pixel_columns_ = static_cast<std::size_t>(settings.grid.columns);
    for (std::int64_t row = settings.grid.rows; row-- > 0;) {
      rings_.push_back(static_cast<std::uint16_t>(row));
    }
    return;
  }
  const std::vector<Beam> beams = make_pattern(settings)->beams(0, Executor(1));
  for (const Beam& beam : beams) rings_.push_back(beam.ring);
  std::sort(rings_.begin(), rings_.end());
  rings_.erase(std::unique(rings_.begin(), rings_.end()), rings_.end());
  turn_of_row_.resize(rings_.size());
  const bool in_turn = std::all_of(beams.begin(), beams.end(), [&](const Beam& beam) {
    const auto i = static_cast<std::size_t>(&beam - beams.data());
    return beam.ring == beams[i % rings_.size()].ring;
  });
  if (!in_turn) {
    throw InputError(
        fmt::format("{}: its rings do not fire in turn, so that its clouds cannot be organised",
                    settings.path));
  }
  for (std::size_t turn = 0; turn < rings_.size(); ++turn) {
    const auto row = std::lower_bound(rings_.begin(), rings_.end(), beams[turn].ring);
    turn_of_row_[static_cast<std::size_t>(row - rings_.begin())] = turn;
  }
}

CloudGrid::Cells CloudGrid::cells_of(const Scan& scan) const {
  if (pixel_columns_ > 0) return {pixel_columns_, 0};
  Cells cells;
  if (!scan.points.empty()) {
    const ScanPoint& point = scan.points.front();
    cells.first = (turn_of_row_[row_of(point)] + rows() - point.beam % rows()) % rows();
  }
  cells.columns = (scan.beams + cells.first + rows() - 1) / rows();
  return cells;
}

std::size_t CloudGrid::row_of(const ScanPoint& point) const {
  if (pixel_columns_ > 0) return point.beam / pixel_columns_;
  const auto row = std::lower_bound(rings_.begin(), rings_.end(), point.ring);
  return static_cast<std::size_t>(row - rings_.begin());
}

std::size_t CloudGrid::column_of(const ScanPoint& point, const Cells& cells) const {
  return pixel_columns_ > 0 ? point.beam % pixel_columns_ : (point.beam + cells.first) / rows();
}

}  // namespace pointflight
