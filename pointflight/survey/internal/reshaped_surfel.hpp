#pragma once

#include <array>

#include "pointflight/map/surfel.hpp"

namespace pointflight {

/// How a surfel changes, along each of its axes as `decode` gives them.
struct Reshaping {
  std::array<double, 3> factors = {1.0, 1.0, 1.0};  ///< Of its standard deviations.
  std::array<double, 3> shifts = {};                ///< Of its centre, in standard deviations.

  bool operator==(const Reshaping&) const = default;
};

/// The surfel so changed: its centre stays in its voxel, a planar one stays planar, a volume stays
/// thicker than that, and spreads end at 1.8 r, the widest that eight bytes can say. One that is
/// not shifted keeps its centre to the bit.
SurfelWord reshaped(SurfelWord word, const Reshaping& change);

}  // namespace pointflight
