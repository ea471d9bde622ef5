// Whether a run ends, why and since when: values.
#pragma once

#include <optional>
#include <vector>

#include "pointflight/core/time.hpp"

namespace pointflight {

/// Why a run ended, or that it goes on.
enum class RunEnd {
  kRunning,            ///< It has not ended.
  kCompleted,          ///< All that was to be done is done.
  kMissionUnfinished,  ///< Time was up with a vehicle away from its goal, crashed or empty.
  kCollision,          ///< A vehicle with on_collision: stop hit something.
  kLeftMap,            ///< `is_lost` (sim/start_check.hpp).
  kInterrupted,        ///< `Simulation::interrupt`.
  kTimeUp,             ///< The same, where the scenario takes that for no failure.
  kIdle  ///< Nothing to do and no commands for `Simulation::kIdleTime`; the scenario has no
         ///< duration.
};
/// The word in summary.json and for users: "completed", "mission unfinished", ...
const char* to_string(RunEnd end);
/// The reason, if the word alone does not say it: half a sentence, or empty.
const char* reason_of(RunEnd end);

/// Whether a run has ended, why and when.
struct Ending {
  RunEnd why = RunEnd::kRunning;  ///< `kRunning`: it goes on.
  SimTime since;                  ///< Start of the step in which it ended.
  /// No further step is done.
  [[nodiscard]] bool is_over() const { return why != RunEnd::kRunning; }
};

/// What matters of a vehicle for the end of a run.
struct VehicleOutlook {
  bool has_plan = false;   ///< The scenario gives it a mission or commands.
  bool arrived = true;     ///< Nothing is left of its mission, and it is neither broken nor empty.
  bool commanded = false;  ///< A program has told it something.
  bool crashed = false;    ///< Its rotors are off for good.
  bool is_lost = false;    ///< It is outside of the map (`is_lost`).
};

/// What matters of a run for its end, at the start of a step, after its collisions.
struct RunOutlook {
  SimTime end_time;            ///< When the run ends by itself, as is known now.
  bool has_duration = false;   ///< The scenario says how long it takes.
  bool may_end_early = false;  ///< An end by duration is none of a failure, if nobody has crashed.
  bool is_landing = false;     ///< A landing under way is waited for.
  bool stops = false;          ///< A vehicle with on_collision: stop hit something.
  std::vector<std::optional<VehicleOutlook>> vehicles;  ///< By number; those that count.
};

/// Whether a run with this outlook ends at `now`.
Ending ending_of(const RunOutlook& outlook, SimTime now);

/// Makes the outlook of all who fly in a run of the outlook of the vehicles that fly here.
class EndingAgreement {
 public:
  virtual ~EndingAgreement() = default;
  /// Asked once in each step, after its collisions.
  virtual RunOutlook agree(const RunOutlook& own) = 0;
};

}  // namespace pointflight
