#pragma once

#include <span>

#include "pointflight/sim/fleet.hpp"
#include "pointflight/world/obstacles.hpp"

namespace pointflight {

/// What vehicles fly among.
struct Neighbourhood {
  const Fleet& fleet;          ///< Each other.
  const SurfelMap& map;        ///< What stands still.
  const Obstacles& obstacles;  ///< What moves by itself.
  Duration step{0};            ///< Of the physics.
  double reach = 0.0;          ///< Distances are known up to here, m.
};

/// Finds what is near each hull that flies here, now that everybody is where they are, and what it
/// hit since the step before; `is_first`: there was none. Events go to `samples`.
void sense_neighbourhood(const Neighbourhood& neighbourhood,
                         SimTime now,
                         bool is_first,
                         std::span<VehicleStatus> statuses,
                         std::span<StepSamples> samples,
                         const Executor& executor);

}  // namespace pointflight
