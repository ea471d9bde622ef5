// Organised clouds: a row for each ring, a column for each firing, NaN where nothing came back.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "pointflight/lidar/lidar_settings.hpp"
#include "pointflight/lidar/scan.hpp"

namespace pointflight {

/// Rows and columns of a sensor's scans.
class CloudGrid {
 public:
  /// Of a sensor whose rings fire in turn, or of a camera, whose pixels the beams are. Throws
  /// InputError for others.
  explicit CloudGrid(const LidarSettings& settings);

  /// Where the beams of one scan lie.
  struct Cells {
    std::size_t columns = 0;  ///< Of the cloud.
    std::size_t first = 0;    ///< Place of its first beam in a firing, which may have begun before.
  };
  /// Of a scan of this sensor.
  [[nodiscard]] Cells cells_of(const Scan& scan) const;

  /// Rings are counted as the vendor does, a camera's rows from the top.
  [[nodiscard]] std::size_t rows() const { return rings_.size(); }
  /// The ring of a row.
  [[nodiscard]] std::uint16_t ring_of(std::size_t row) const { return rings_[row]; }
  /// Row of a point in its scan's cloud.
  [[nodiscard]] std::size_t row_of(const ScanPoint& point) const;
  /// Its column.
  [[nodiscard]] std::size_t column_of(const ScanPoint& point, const Cells& cells) const;

 private:
  std::size_t pixel_columns_ = 0;         ///< Of a camera; 0: it is none.
  std::vector<std::uint16_t> rings_;      ///< By row.
  std::vector<std::size_t> turn_of_row_;  ///< In a firing.
};

}  // namespace pointflight
