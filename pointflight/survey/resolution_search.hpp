// Which resolution suits a place: tried, not guessed.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

namespace pointflight {

/// How a resolution did on rays that its map has not seen.
struct TriedResolution {
  double resolution;   ///< r, m.
  double right;        ///< Share of their rays, those without a return included.
  std::uint64_t rays;  ///< That judged it; 0: nothing does.
};

/// Makes a map and judges it: at a resolution (m), or at the one that the points' spacing supports.
using TryResolution = std::function<TriedResolution(const std::optional<double>& resolution)>;

/// Tries the resolution that the points support, then coarser ones, a factor of the square root of
/// two apart, until one is worse than the one before; if the first of them is, finer ones likewise.
/// From 5 mm to 1 m. In ascending order.
std::vector<TriedResolution> search_resolutions(const TryResolution& try_one);

/// The finest that is within 0.3 % of the rays of the best: what is smaller than the rays tell is
/// not lost without need.
double best_resolution(const std::vector<TriedResolution>& tried);

}  // namespace pointflight
