#pragma once

#include <functional>
#include <string_view>

namespace pointflight {

/// Called now and then by long work with what it is doing and the share done, 0 to 1. The command
/// line prints a line from it; an empty function is fine.
using Progress = std::function<void(std::string_view what, double share)>;

/// Calls `progress` if there is one.
inline void report(const Progress& progress, std::string_view what, double share) {
  if (progress) progress(what, share);
}

}  // namespace pointflight
