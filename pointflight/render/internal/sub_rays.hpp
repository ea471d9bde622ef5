// Rays over the cross-section of a beam (`WideBeams`).
#pragma once

#include <cstddef>
#include <vector>

namespace pointflight {

/// Its position in sigmas, and its share of the light.
struct SubRay {
  float x, y, share;
};

/// No sub-ray lies farther from its beam's axis, sigmas: the corners of a heptagon around the
/// cross-section.
inline constexpr float kSubRayRadius = 2.22f;

/// The middle and seven on a circle around the cross-section, so that no edge across it lies
/// between them, with the shares that give the cross-section's second moment.
std::vector<SubRay> rim_of_eight();

/// So many, evenly over the cross-section (a sunflower's seeds), with the Gaussian's shares: what
/// is on the rim is hit as surely as what is in the middle. Eight that follow each other lie in one
/// sector, as far as possible.
std::vector<SubRay> spread_sub_rays(std::size_t count);

/// An angle by which the sub-rays of a beam are turned: each beam's by one of its own, so that
/// errors of neighbours differ.
struct Turn {
  float cosine, sine;
};
Turn turn_of(std::size_t beam);

/// Eight sub-rays in lanes.
struct SubRayLanes {
  alignas(32) float x[8], y[8], share[8];
};

/// The sub-rays that a beam is given as long as it takes more: eight, 32, 96, 288.
inline constexpr std::size_t kSubRayLevels = 4;
inline constexpr std::size_t kLevelSizes[kSubRayLevels] = {8, 32, 96, 288};
const SubRayLanes& first_sub_rays();

/// Those of a further level, by eights that lie in strips across one of some directions.
///@{
inline constexpr std::size_t kStripDirections = 8;
struct StripDirections {
  alignas(32) float x[kStripDirections], y[kStripDirections];
};
const StripDirections& strip_directions();
const std::vector<SubRayLanes>& sub_rays_of_level(std::size_t level, std::size_t direction);
///@}

}  // namespace pointflight
