#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <span>

#include "pointflight/io/cloud_reader.hpp"

namespace pointflight {

/// What coordinates far from zero are rounded to.
struct CoarseCoordinates {
  double step = 0.0;      ///< In the file's unit, of the axis that has the widest.
  double farthest = 0.0;  ///< The greatest coordinate of that axis, without its sign.
};

/// Finds out whether the points of a file were stored with too few digits for how far from zero
/// they are: floats at 4.8e6 have steps of 0.5, text with six digits of 10. Coordinates on a
/// lattice that is wider than their number type needs are none of these.
class CoordinateSteps {
 public:
  /// Points of a file in its own coordinates; looks at some of them.
  void add(std::span<const CloudPoint> points);
  /// Nothing if the steps are as fine as anybody wants.
  [[nodiscard]] std::optional<CoarseCoordinates> coarse(double metres_per_unit) const;

 private:
  struct Axis {
    int binary = 1024;  ///< Coordinates are multiples of 2^binary.
    int decimal = 9;    ///< They are multiples of 10^decimal.
    double farthest = 0.0;
    bool varies = false;
    double first = 0.0;
    std::size_t count = 0;
  };
  std::array<Axis, 3> axes_;
};

}  // namespace pointflight
