// Scans that somebody recorded, point by point.
#pragma once

#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "pointflight/core/progress.hpp"
#include "pointflight/geometry/types.hpp"

namespace pointflight {

/// A return of a scan that somebody recorded.
struct RecordedPoint {
  Vector3f position = Vector3f::Zero();  ///< Sensor frame, m.
  std::int32_t ring = -1;                ///< -1: the recording does not say.
  /// By a clock that goes on within the scan, s; NaN: the recording does not say.
  double time = std::numeric_limits<double>::quiet_NaN();
};

/// A scan that somebody recorded.
struct RecordedScan {
  double time = std::numeric_limits<double>::quiet_NaN();  ///< Its stamp, s; NaN: none.
  std::vector<RecordedPoint> points;                       ///< In the recording's order.
};

/// The first `most` clouds of a folder, by their names; a name that is a number is the scan's time
/// where it has decimals or is in ns. Throws InputError.
std::vector<RecordedScan> read_scans_of_folder(const std::string& folder,
                                               std::size_t most,
                                               const Progress& progress = {});

}  // namespace pointflight
