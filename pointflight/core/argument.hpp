#pragma once

#include <stdexcept>

namespace pointflight {

/// Checks an argument that the calling program controls (a null pointer, sizes that differ, NaN):
/// throws std::invalid_argument that says what is expected. Not for a user's files and flags, which
/// are InputErrors, nor for inner loops, which state a precondition and assert it.
inline void require_argument(bool fine, const char* wanted) {
  if (!fine) throw std::invalid_argument(wanted);
}

}  // namespace pointflight
