// A cloud without scans says where surfaces are, not which rays saw them. A few of its points are
// left out of a map, and rays towards them tell whether the map shows what the others did not say.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "pointflight/core/parallel.hpp"
#include "pointflight/geometry/types.hpp"

namespace pointflight {

/// A ray that ends at the surface beside a point that was left out.
struct LeftOutRay {
  Ray ray;             ///< From where a sensor could be.
  float range = 0.0f;  ///< At which it should end, m.
};

inline constexpr std::size_t kLeaveOut = 20;  ///< One point of so many is left out.

/// By a hash of its number.
bool is_left_out(std::size_t point);

/// Rays from up to 32 positions, 0.8 to 1.8 m above level ground and 0.7 m or more from everything,
/// to points that are left out: in each direction (cells of a degree) the nearest, within 0.5 to
/// 30 m, with 16 points or more within 0.25 m. Three rays each: to the point, and to two positions
/// between it and one of the six nearest. If points were thinned, each lies where no other is near,
/// which is worse than where beams end; between two it is better: together they come near to what
/// real and exact scans say.
///
/// Only rays that nothing hides: no point lies within 0.3 spacings of them, and nowhere are points
/// within three spacings all around (they leave 150 degrees free where a ray passes an edge or
/// along a floor). Of 64 candidates the half that see most are taken, if they see half as much as
/// the best one: the top of a ceiling is level ground, too.
///
/// `points`: m, z up, from `origin_world`; `spacing`: between neighbours, m. Without level ground,
/// room or enough points there are none. Does not depend on the threads.
std::vector<LeftOutRay> rays_to_left_out(std::span<const Vector3f> points,
                                         const Vector3d& origin_world,
                                         double spacing,
                                         const Executor& executor);

}  // namespace pointflight
