#pragma once

#include <cmath>
#include <concepts>
#include <limits>
#include <optional>

namespace pointflight {

/// A number that was read as a whole number within [least, most]; nothing for all others: NaN,
/// infinities, fractions, what `Integer` or a double cannot hold exactly. To convert those is
/// undefined, so whoever takes counts, labels and indices from files comes by here.
template <std::integral Integer>
std::optional<Integer> whole_number(double value,
                                    Integer least = std::numeric_limits<Integer>::lowest(),
                                    Integer most = std::numeric_limits<Integer>::max()) {
  constexpr double kExact = 9007199254740992.0;  // 2^53: above it doubles skip whole numbers
  if (!(std::abs(value) <= kExact) || std::floor(value) != value) return std::nullopt;
  if (value < static_cast<double>(least) || value > static_cast<double>(most)) return std::nullopt;
  return static_cast<Integer>(value);
}

}  // namespace pointflight
