// What the processes of a shared run tell each other in a step.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "pointflight/core/time.hpp"
#include "pointflight/vehicle/state.hpp"

namespace pointflight {

/// What the process that flies a vehicle tells the others of it.
struct SharedVehicle {
  std::uint32_t number = 0;  ///< In the fleet, from 0.
  RigidBodyState body;       ///< Truth.
  bool crashed = false;      ///< Rotors off for good.
  bool arrived = true;     ///< Nothing is left of its mission, and it is neither broken nor empty.
  bool commanded = false;  ///< A program has told it something.
  bool jumped = false;     ///< Received: it is not where it was, and did not fly here.
};

/// What a process tells the others at the start of a step.
struct SharedStep {
  SimTime time;             ///< Of the states.
  SimTime end_time;         ///< When its run ends by itself, as it knows now.
  bool is_landing = false;  ///< A landing under way is waited for.
  bool stops = false;       ///< A vehicle with on_collision: stop hit something.
  bool is_verdict = false;  ///< In lockstep: said once more in a step, after its collisions.
  std::vector<SharedVehicle> vehicles;  ///< Its own.
};

/// What the other processes said.
struct OtherVehicles {
  /// The latest of theirs, and in lockstep of this process' as well.
  SimTime end_time;
  bool is_landing = false;  ///< The same: any of them.
  bool stops = false;       ///< Any of them.
  /// By number; nothing for own ones and those that nobody flies, or that are lost and vanish.
  std::vector<std::optional<SharedVehicle>> vehicles;
};

}  // namespace pointflight
