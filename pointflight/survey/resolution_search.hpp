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
  double right;        ///< Share of what they see that is right, from 0 to 1.
  std::uint64_t rays;  ///< That judged it; 0: nothing does.
};

/// Makes a map and judges it: at a resolution (m), or at the one that the points' spacing supports.
using TryResolution = std::function<TriedResolution(const std::optional<double>& resolution)>;

/// Tries the resolution that the points support, then coarser ones, a factor of the square root of
/// two apart, until one is worse than the best of them by more than `slack`;
/// if none is better than the first one, finer ones likewise. From 5 mm to 1 m. In ascending order.
std::vector<TriedResolution> search_resolutions(const TryResolution& try_one, double slack);

/// Tries, beside what was tried, halfway (in the logarithm) between the best and its neighbours.
/// Nothing if a single one was tried. In ascending order.
std::vector<TriedResolution> refine_resolutions(std::vector<TriedResolution> tried,
                                                const TryResolution& try_one);

/// The finest whose share of right rays is within `level` of the best one's.
double best_resolution(const std::vector<TriedResolution>& tried, double level);

/// Where a parabola over the resolutions' logarithms, fitted to those within an octave and 2 % of
/// the best one, is highest; the best one if fewer than four are, or they lie on none.
/// How a grid happens to
/// cut surfaces moves shares by tenths of a percent, as much as neighbours differ.
double peak_resolution(const std::vector<TriedResolution>& tried);

}  // namespace pointflight
