#pragma once

#include <cstdint>

namespace pointflight {

/// Floor of |x| < 2^63, inline if std::floor is a call (CPUs before SSE4.1).
inline std::int64_t floor_to_integer(double x) {
  const auto towards_zero = static_cast<std::int64_t>(x);
  return towards_zero - (x < static_cast<double>(towards_zero) ? 1 : 0);
}

}  // namespace pointflight
