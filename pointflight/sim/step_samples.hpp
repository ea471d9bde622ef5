#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "pointflight/sim/samples.hpp"

namespace pointflight {

/// The order of a vehicle's samples at one instant: what happened first.
///@{
inline constexpr std::size_t kCollisionRank = 0, kEventRank = 1, kStateRank = 2;
///@}
inline constexpr std::size_t kSensorRank = 3;  ///< Of the first sensor; the others follow.

/// What one vehicle says within a step.
struct StepSamples {
  /// A sample and its position among those of its instant: what happened first, then what happened
  /// on board, the truth, sensors in their order.
  struct Item {
    SimTime time;          ///< When it arrives.
    std::size_t rank = 0;  ///< Among those of its instant.
    Sample sample;         ///< What is said.
  };
  std::vector<CollisionEvent> collisions;  ///< Entered or left in this step.
  std::vector<Item> items;                 ///< All else.
};

/// Hands all vehicles' samples of a step to a sink, in the order (time, rank, vehicle).
void deliver(std::span<StepSamples> samples, SampleSink& sink);

}  // namespace pointflight
