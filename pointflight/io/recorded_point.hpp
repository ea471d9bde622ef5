#pragma once

#include <cstdint>
#include <limits>

#include "pointflight/geometry/types.hpp"

namespace pointflight {

/// A point of a scan that somebody recorded.
struct RecordedPoint {
  Vector3d position = Vector3d::Zero();  ///< In the scan's frame, m; may be NaN.
  float intensity = 0.0f;                ///< In the recording's own scale; 0: it has none.
  /// Since the scan's stamp or since 1970, s; NaN: it has none.
  double time = std::numeric_limits<double>::quiet_NaN();
  std::int32_t ring = -1;  ///< ring, line, channel; -1: it has none.
};

}  // namespace pointflight
