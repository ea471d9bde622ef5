#pragma once

#include <string>
#include <vector>

namespace pointflight {

/// The vehicles that a list means: numbers from 0, names (of `names`, by number), and ranges of
/// either, such as "0-3". A name goes before a range, for names may have dashes.
/// Returns their numbers, ascending, each once. Throws InputError if an item means none.
std::vector<std::size_t> vehicles_from(const std::vector<std::string>& list,
                                       const std::vector<std::string>& names);

}  // namespace pointflight
