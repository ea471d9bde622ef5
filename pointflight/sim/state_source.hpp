#pragma once

#include <optional>

#include "pointflight/core/time.hpp"
#include "pointflight/vehicle/state.hpp"

namespace pointflight {

/// States of a vehicle that is simulated elsewhere: another process, a recording, a real flight.
/// They take the place of the local dynamics (`Simulation::follow`).
class StateSource {
 public:
  virtual ~StateSource() = default;

  /// The state at an instant, which it may wait for; nothing, or a number that is not finite: the
  /// last one stays. Asked once for each physics step, in order.
  virtual std::optional<RigidBodyState> state_at(SimTime time) = 0;
};

}  // namespace pointflight
