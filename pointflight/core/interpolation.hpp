#pragma once

#include <algorithm>
#include <cassert>
#include <span>

namespace pointflight {

/// The piece of such a line (`on_line`) at `x`, from point i - 1 to point i: i.
inline std::size_t piece_at(std::span<const double> xs, double x) {
  assert(xs.size() >= 2);
  return static_cast<std::size_t>(std::upper_bound(xs.begin() + 1, xs.end() - 1, x) - xs.begin());
}

/// Value at `x` of the straight line through points i - 1 and i of (xs, ys).
inline double on_piece(std::span<const double> xs,
                       std::span<const double> ys,
                       std::size_t i,
                       double x) {
  return ys[i - 1] + (ys[i] - ys[i - 1]) * (x - xs[i - 1]) / (xs[i] - xs[i - 1]);
}

/// Value at `x` of the line through points (xs, ys): straight between them and, beyond the first
/// and the last, straight on. As many of each, two at least, `xs` ascending.
inline double on_line(std::span<const double> xs, std::span<const double> ys, double x) {
  assert(xs.size() == ys.size());
  return on_piece(xs, ys, piece_at(xs, x), x);
}

}  // namespace pointflight
