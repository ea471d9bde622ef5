#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <vector>

#include "pointflight/core/time.hpp"
#include "pointflight/geometry/types.hpp"
#include "pointflight/map/body.hpp"
#include "pointflight/world/obstacles.hpp"

namespace pointflight {

/// Where a vehicle was over one period of its policy.
struct PosePair {
  Pose before;          ///< T_world_body at its start.
  Pose now;             ///< At its end.
  SimTime before_time;  ///< On the clock of the obstacles.
  SimTime time;         ///< Of `now`.
};

/// What moves around vehicles that learn: obstacles, and the vehicles of the same team.
class Traffic {
 public:
  /// Obstacles, or null; `vehicle`: what the others of a team are seen and hit as, its motion
  /// apart.
  Traffic(std::shared_ptr<const Obstacles> obstacles, Body vehicle);

  /// Distance of the hull of `team[own]` to whatever of it is nearest, m, `reach` if all is
  /// farther; minus how deep if they overlap. `team`: where each is at `time`, itself included.
  [[nodiscard]] double clearance(std::span<const Pose> team,
                                 std::size_t own,
                                 SimTime time,
                                 double reach) const;

  /// What the LiDAR of `team[own]` can see within `range_max` (m) over the period.
  [[nodiscard]] std::vector<Body> bodies(std::span<const PosePair> team,
                                         std::size_t own,
                                         double range_max) const;

 private:
  std::shared_ptr<const Obstacles> obstacles_;
  Body vehicle_;
  Solid hull_;
  double hull_radius_;
};

}  // namespace pointflight
