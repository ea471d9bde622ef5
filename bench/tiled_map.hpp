#pragma once

#include <memory>

#include "pointflight/map/surfel_map.hpp"

namespace pointflight {

/// A map repeated side by side, `across` times along x and `along` times along y: large maps in
/// seconds. Intensities and other sections are left out.
std::shared_ptr<const SurfelMap> tiled(const SurfelMap& map, int across, int along);

}  // namespace pointflight
