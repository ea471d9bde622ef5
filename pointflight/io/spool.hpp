#pragma once

#include <memory>
#include <string>

#include "pointflight/core/progress.hpp"

namespace pointflight {

/// Copies what a descriptor gives until its end into a file without a name in `folder` (empty: that
/// of temporary files); the file goes away with the last copy of the result. Throws InputError
/// that starts with `name`.
std::shared_ptr<const int> spool(int descriptor,
                                 const std::string& name,
                                 const std::string& folder,
                                 const Progress& progress);

}  // namespace pointflight
