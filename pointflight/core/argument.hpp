#pragma once

#include <stdexcept>

namespace pointflight {

/// For what a calling program got wrong (a null pointer, sizes that do not fit, NaN): throws
/// std::invalid_argument that says what was wanted. Not for a user's files and flags, which are
/// InputErrors, nor for inner loops, which state a precondition and assert it.
inline void require_argument(bool fine, const char* wanted) {
  if (!fine) throw std::invalid_argument(wanted);
}

}  // namespace pointflight
