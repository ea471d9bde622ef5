// Which scans a map was fitted to.
#pragma once

#include <cstdint>
#include <vector>

#include "pointflight/map/map_file.hpp"
#include "pointflight/map/surfel_map.hpp"

namespace pointflight {

/// Adds scans to those that a map was fitted to, by numbers that tell scans apart
/// (`scan_fingerprint`).
void add_fitted_scans(MapDescription& description, std::vector<std::uint64_t> fingerprints);

/// Those that a map was fitted to, in ascending order.
std::vector<std::uint64_t> fitted_scans(const SurfelMap& map);

}  // namespace pointflight
