#pragma once

#include <cstdint>

#include "pointflight/sim/scenario.hpp"

namespace pointflight {

/// How processes that share a run keep time.
enum class ShareTime {
  kFree,      ///< Each by its wall clock; others' vehicles are moved on at their velocities.
  kLockstep,  ///< Step by step together: the bytes of one process.
};
/// What becomes of a vehicle's body when nothing is heard of it any more.
enum class OnLoss {
  kVanish,  ///< It is not there.
  kHold,    ///< It stands where it was seen last.
};
/// Where a vehicle goes on whose process was ended in the middle and is started again.
enum class OnReturn {
  kStart,  ///< At its start.
  kLog,    ///< Where the trajectory that the ended process left stops.
};

/// A scenario's `share`.
struct ShareSetup {
  ShareTime time = ShareTime::kFree;      ///< How processes keep time.
  double rate = 100.0;                    ///< Of states that are sent, Hz; in lockstep each step.
  std::int64_t ahead = 0;                 ///< In lockstep: steps that nobody waits for.
  double lease = 1.0;                     ///< Silent for so long is lost, s.
  OnLoss on_loss = OnLoss::kVanish;       ///< What becomes of a lost body.
  OnReturn on_return = OnReturn::kStart;  ///< Where a restarted process begins.
};

/// The keys of `share`.
void describe(SettingsVisitor& visitor, ShareSetup& setup);

/// What a scenario says of sharing; the defaults if it says nothing.
const ShareSetup& share_setup_of(const Scenario& scenario);

}  // namespace pointflight
