#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "pointflight/geometry/motion.hpp"
#include "pointflight/sim/samples.hpp"

namespace pointflight {

/// A vehicle's state as its source knows it.
struct SourcedState {
  RigidBodyState body;   ///< Truth.
  bool crashed = false;  ///< Its rotors are off for good.
  bool jumped = false;   ///< It is elsewhere than before, without having flown there.
};

/// How well a source has known where its vehicle was.
struct SourceReport {
  std::uint32_t vehicle = 0;           ///< Number in the fleet, from 0.
  std::string flown_by;                ///< Who flew it last: "host:4711"; empty: nobody has.
  std::uint64_t losses = 0;            ///< How often it was lost after it had been seen.
  Duration apart{0};                   ///< How long it was lost altogether.
  std::uint64_t missed_contacts = 0;   ///< With own vehicles meanwhile, as found afterwards.
  std::uint64_t unknown_contacts = 0;  ///< Losses of which nobody could say afterwards.
  double extrapolated_max = 0.0;       ///< Longest time that its state was extrapolated, s.
  double extrapolation_bound = 0.0;    ///< How far off any point of its hull was then at most, m.
};

/// Where a vehicle's state comes from if not from its own dynamics: another process, an outside
/// simulator, a log. Called from the thread that steps the simulation.
class VehicleSource {
 public:
  virtual ~VehicleSource() = default;

  /// True if the vehicle is flown elsewhere as a whole: here it is seen and hit, but has no
  /// sensors, controllers or samples. False: its motion alone comes from the source.
  [[nodiscard]] virtual bool flies_elsewhere() const { return false; }

  /// The state at the start of the step at `time`, for which it may wait; asked once for each step,
  /// in order. Nothing: a vehicle that is flown elsewhere is not there; another one stays.
  virtual std::optional<SourcedState> state_at(SimTime time) = 0;

  /// Where the vehicle was in [from, until] if that is known better by now than from the states
  /// that were given.
  [[nodiscard]] virtual std::optional<PoseTrack> track(SimTime /*from*/, SimTime /*until*/) const {
    return std::nullopt;
  }

  /// What happened since it was last asked, to this vehicle or to others because of it: lost,
  /// heard again, hit while it was lost.
  virtual std::vector<VehicleEvent> take_events() { return {}; }

  /// Nothing for a source that always knows.
  [[nodiscard]] virtual std::optional<SourceReport> report() const { return std::nullopt; }
};

}  // namespace pointflight
