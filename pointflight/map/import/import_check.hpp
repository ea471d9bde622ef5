#pragma once

#include <string>
#include <vector>

#include "pointflight/map/import/map_builder.hpp"

namespace pointflight {

/// What looks wrong about an imported world, one line each with what would mend it: a unit that the
/// file names and the import did not use, sizes and spacings that no place to fly in has, a floor
/// that is not level.
std::vector<std::string> import_warnings(const ImportReport& report,
                                         const ImportOptions& options,
                                         const Aabb& bounds_world);

/// The same for the floor alone; empty if it is level or there is none.
std::string floor_warning(const FloorPlane& floor);

/// Throws InputError if an option is none: what the command line cannot give, a program may.
void check_options(const ImportOptions& options);

}  // namespace pointflight
