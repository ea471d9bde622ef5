#pragma once

#include <cstddef>
#include <variant>

#include "pointflight/core/time.hpp"
#include "pointflight/vehicle/command.hpp"

namespace pointflight {

/// A command for a vehicle.
struct VehicleOrder {
  std::size_t vehicle = 0;  ///< Number in the fleet.
  Command command;          ///< In the program's units and frames.
  bool is_answer = false;   ///< What lockstep waits for (`Link::wants_answer`).
};
struct AnswerOrder {};  ///< The answer of one who has nothing to command.
/// Stop the run, or go on.
struct PauseOrder {
  bool pause = true;  ///< False: go on.
};
struct StepOrder {};   ///< While paused: go on until the next scan.
struct ResetOrder {};  ///< Back to the start.
struct EndOrder {};    ///< End the run as interrupted.
/// Hold the run to so many simulated seconds per second from here on.
struct RateOrder {
  double rate = 1.0;  ///< 0: as fast as it goes.
};
/// Of a run that is played back: go to another time.
struct SeekOrder {
  SimTime to;  ///< Of the run.
};
/// Of a run that is shared with other processes: be where they are (`Simulation::skip_to`).
struct SkipOrder {
  SimTime to;  ///< Of the run; later than it is.
};
/// Of a shared run that lags a little: from now on every instant is due earlier by `by`.
struct ShiftPaceOrder {
  Duration by{0};  ///< Of the wall clock.
};

/// What may be told to a run from outside; those without a vehicle are about the run.
using Order = std::variant<VehicleOrder,
                           AnswerOrder,
                           PauseOrder,
                           StepOrder,
                           ResetOrder,
                           EndOrder,
                           RateOrder,
                           SeekOrder,
                           SkipOrder,
                           ShiftPaceOrder>;

}  // namespace pointflight
