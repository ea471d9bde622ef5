#pragma once

#include <string>

#include "pointflight/map/import/map_builder.hpp"

namespace pointflight {

/// What a map keeps of its import, as JSON: sources, options, what was found.
std::string import_metadata(const ImportReport& report, const ImportOptions& options);

}  // namespace pointflight
