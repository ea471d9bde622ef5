// The beams that real scans' returns came along, and the directions that a sensor is divided into.
#pragma once

#include <cstddef>
#include <vector>

#include "pointflight/core/parallel.hpp"
#include "pointflight/fidelity/scan_comparison.hpp"
#include "pointflight/geometry/types.hpp"
#include "pointflight/lidar/lidar.hpp"

namespace pointflight {

/// Cells of directions in the sensor frame: 5 degrees of azimuth and of elevation.
struct DirectionCells {
  static constexpr double kSize = 5.0;                     ///< deg
  static constexpr std::size_t kColumns = 72;              ///< Of azimuth, from -180 degrees on.
  static constexpr std::size_t kRows = 36;                 ///< Of elevation, from -90 degrees on.
  static constexpr std::size_t kCount = kColumns * kRows;  ///< Row by row.
  /// Of a unit vector.
  static std::size_t of(const Vector3f& direction_sensor);
};

/// From where on scans have returns, m: all but a thousandth of them. 0 if there are none.
double least_range_of(const std::vector<RealScan>& scans);

/// Beams of one scan that came back.
struct RealBeams {
  std::vector<Vector3f> origins_sensor;     ///< m
  std::vector<Vector3f> directions_sensor;  ///< Unit vectors.
  std::vector<float> ranges;                ///< m
};

/// Where a sensor's beams leave it, cell by cell: it changes little within one.
class BeamOrigins {
 public:
  /// By the beams of the pattern's scans 0 to `scans` - 1.
  BeamOrigins(const Lidar& lidar, std::size_t scans, const Executor& executor);

  /// How many beams all these scans have in a cell.
  [[nodiscard]] double fired(std::size_t cell) const { return fired_[cell]; }
  /// In all cells.
  [[nodiscard]] double beams() const { return beams_; }
  /// Of a scan of that sensor.
  [[nodiscard]] RealBeams of(const RealScan& scan) const;

 private:
  std::vector<double> fired_;
  std::vector<Vector3f> origins_;  ///< Mean, m in the sensor frame.
  double beams_ = 0.0;
};

}  // namespace pointflight
