// Beams in the world, many at a time.
#pragma once

#include <cstddef>
#include <span>

#include "pointflight/render/sensor_beams.hpp"

namespace pointflight {

/// A beam in the world.
struct AimedBeam {
  float shift[3];      ///< Of its origin, from `AimedBeams::position_world`, m.
  float direction[3];  ///< Unit vector.
  float across[3];     ///< `make_across`, if it is asked for.
};

/// The beams from `begin` on: the same bits on all processors, and on GPUs (gpu/kernel/aim.glsl):
/// multiplications and additions of floats alone, none of them contracted.
void aim_some(const AimedBeams& aimed,
              std::size_t begin,
              std::span<AimedBeam> made,
              bool wants_across);

}  // namespace pointflight
