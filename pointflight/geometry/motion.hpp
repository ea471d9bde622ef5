#pragma once

#include <functional>

#include "pointflight/core/time.hpp"
#include "pointflight/geometry/types.hpp"

namespace pointflight {

/// Where something is at an instant: T_world_body. Must be callable from several threads.
using PoseAt = std::function<Pose(SimTime)>;

}  // namespace pointflight
