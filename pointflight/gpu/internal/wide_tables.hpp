#pragma once

#include <cstdint>
#include <vector>

#include "pointflight/map/surfel_map.hpp"
#include "pointflight/render/wide_beams.hpp"

namespace pointflight {

/// What the kernel of wide beams looks up (`kAtTurns` and so on of kernel/layout.glsl): positions
/// of sub-rays, intensities of the map's codes, reflectivities of surfels of which nothing is
/// known.
[[nodiscard]] std::vector<std::uint32_t> wide_tables(const SurfelMap& map,
                                                     const Reflectances& reflectances);

}  // namespace pointflight
