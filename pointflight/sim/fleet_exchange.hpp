// A run that several processes share: each simulates some of its vehicles, all see all of them.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "pointflight/geometry/motion.hpp"
#include "pointflight/sim/samples.hpp"

namespace pointflight {

/// What the process that simulates a vehicle tells the others of it.
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
  bool stops = false;       ///< A vehicle with on_collision: stop met something.
  bool is_verdict = false;  ///< Said once more in a step, after collisions (`decides_together`).
  std::vector<SharedVehicle> vehicles;  ///< Its own.
};

/// What the other processes said.
struct OtherVehicles {
  /// The latest of theirs, and where all decide together of this process' as well.
  SimTime end_time;
  bool is_landing = false;  ///< The same: any of them.
  bool stops = false;       ///< Any of them.
  /// By number; nothing for own ones and those that nobody flies, or that are lost and vanish.
  std::vector<std::optional<SharedVehicle>> vehicles;
};

/// What was not known of a vehicle of another process.
struct ApartSummary {
  std::uint32_t vehicle = 0;  ///< Number in the fleet, from 0.
  std::string flown_by;       ///< The process that flew it last: "host:4711"; empty: nobody has.
  std::uint64_t losses = 0;   ///< Times that it was lost after it had been seen.
  Duration apart{0};          ///< How long it was lost altogether.
  std::uint64_t missed_contacts = 0;   ///< With own vehicles meanwhile, as found afterwards.
  std::uint64_t unknown_contacts = 0;  ///< Losses of which nobody could say afterwards.
  double extrapolated_max = 0.0;       ///< Longest time that its state was moved on, s.
  double extrapolation_bound = 0.0;    ///< How far off any point of its hull was then at most, m.
};

/// The other processes, as a simulation sees them. Called from the thread that steps it.
class FleetExchange {
 public:
  virtual ~FleetExchange() = default;

  /// Tells the others, and says where their vehicles are at `own.time`. Waits in lockstep.
  virtual OtherVehicles meet(const SharedStep& own) = 0;

  /// True in lockstep: the run ends for all at once, so that collisions that end it and the last
  /// step are told a second time in their step.
  [[nodiscard]] virtual bool decides_together() const = 0;

  /// Where another process' vehicle was in [from, until], as it is known by now; nothing: as `meet`
  /// said at each step.
  [[nodiscard]] virtual std::optional<PoseTrack> track(std::size_t vehicle,
                                                       SimTime from,
                                                       SimTime until) const = 0;

  /// What happened between processes since it was last asked: vehicles that were lost, that came,
  /// that were met while apart.
  virtual std::vector<VehicleEvent> take_events() = 0;

  /// Of all vehicles of others, by number.
  [[nodiscard]] virtual std::vector<ApartSummary> apart() const = 0;
};

}  // namespace pointflight
