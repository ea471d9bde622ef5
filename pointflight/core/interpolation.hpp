#pragma once

#include <algorithm>
#include <cassert>
#include <span>

namespace pointflight {

/// Value at `x` of the line through points (xs, ys): straight between them and, beyond the first
/// and the last, straight on. As many of each, two at least, `xs` ascending.
inline double on_line(std::span<const double> xs, std::span<const double> ys, double x) {
  assert(xs.size() == ys.size() && xs.size() >= 2);
  const auto above = std::upper_bound(xs.begin() + 1, xs.end() - 1, x);
  const auto i = static_cast<std::size_t>(above - xs.begin());
  return ys[i - 1] + (ys[i] - ys[i - 1]) * (x - xs[i - 1]) / (xs[i] - xs[i - 1]);
}

}  // namespace pointflight
