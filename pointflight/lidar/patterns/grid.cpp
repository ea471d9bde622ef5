#include "pointflight/core/constants.hpp"
#include "pointflight/core/input_error.hpp"
#include "pointflight/lidar/lidar_settings.hpp"
#include "pointflight/lidar/patterns/patterns.hpp"

namespace pointflight {
namespace {

/// Rows of beams that all fire at the scan's start: a global-shutter depth camera, or the dense
/// grid of the paper. Rows from the top down, columns from the left to the right.
class GridPattern : public BeamPattern {
 public:
  explicit GridPattern(const LidarSettings& settings) {
    const GridSettings& s = settings.grid;
    const bool pinhole = s.projection == GridProjection::kPinhole;
    if (pinhole && !(s.fx > 0.0 && s.fy > 0.0)) {
      throw InputError("grid.projection: pinhole needs fx and fy");
    }
    for (std::int64_t row = 0; row < s.rows; ++row) {
      for (std::int64_t column = 0; column < s.columns; ++column) {
        const auto u = static_cast<double>(column);
        const auto v = static_cast<double>(row);
        const Vector3d direction =
            pinhole ? Vector3d(1.0, -(u - s.cx) / s.fx, -(v - s.cy) / s.fy).normalized()
                    : direction_of(cell_angle(column, s.columns, s.fov_horizontal_deg),
                                   cell_angle(row, s.rows, s.fov_vertical_deg));
        beams_.push_back({Vector3f::Zero(),
                          direction.cast<float>(),
                          Duration{0},
                          static_cast<std::uint16_t>(s.rows - 1 - row)});
      }
    }
  }

  [[nodiscard]] bool repeats() const override { return true; }

  [[nodiscard]] std::vector<Beam> beams(std::uint64_t /*scan_index*/,
                                        const Executor& /*executor*/) const override {
    return beams_;
  }

 private:
  /// Centre of cell i, the first on the positive side (left, top).
  static double cell_angle(std::int64_t i, std::int64_t count, double fov_deg) {
    const double share = (static_cast<double>(i) + 0.5) / static_cast<double>(count);
    return (0.5 - share) * fov_deg * kDegree;
  }

  std::vector<Beam> beams_;
};

}  // namespace

std::unique_ptr<BeamPattern> make_grid_pattern(const LidarSettings& settings) {
  return std::make_unique<GridPattern>(settings);
}

}  // namespace pointflight
