#pragma once

#include <vector>

#include "pointflight/core/parallel.hpp"
#include "pointflight/scenes/exact_scene.hpp"

namespace pointflight {

/// A way on which a person with a LiDAR comes near everything that can be walked to: to the nearest
/// part that has not been seen from nearby, again and again, and back to the start. Corners of
/// straight legs (world, m) 1.2 to 1.8 m above what is below, 0.25 m or more from everything (both
/// to within 0.2 m). How near follows from `length`, which it is about as long as (m), if it needs
/// to be. Throws InputError if there is no room.
std::vector<Vector3d> plan_survey_way(const ExactScene& scene,
                                      double length,
                                      const Executor& executor);

}  // namespace pointflight
