#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "pointflight/core/progress.hpp"

namespace pointflight {

/// Fills a block and returns how many bytes it put there; 0: the end, nothing: not yet.
using BlockReader = std::function<std::optional<std::size_t>(std::span<std::byte> block)>;

/// Copies what is read until its end into a file without a name in `folder` (empty: that of
/// temporary files); the file goes away with the last copy of the result. Throws InputError that
/// starts with `name`.
std::shared_ptr<const int> spool(const BlockReader& read,
                                 const std::string& name,
                                 const std::string& folder,
                                 const Progress& progress);

/// The same of a descriptor.
std::shared_ptr<const int> spool(int descriptor,
                                 const std::string& name,
                                 const std::string& folder,
                                 const Progress& progress);

}  // namespace pointflight
