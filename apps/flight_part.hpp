#pragma once

#include <chrono>
#include <memory>

#include "pointflight/run/run_loop.hpp"
#include "pointflight/sim/scenario.hpp"
#include "pointflight/sim/simulation.hpp"

namespace pointflight::apps {

/// How long samples that only reach files may be held back (`ThreadedLink::Options::hold`).
inline constexpr std::chrono::milliseconds kFilesWait(5);

/// Somebody whom a flight is for: the user at the terminal, a folder of results, ROS, recordings
/// and viewers, other processes that share the run. `fly` calls each part's functions in this
/// order; if one throws InputError nothing is flown.
class FlightPart {
 public:
  virtual ~FlightPart() = default;

  /// Before any file is read: flags that have no effect or do not go together. Throws InputError.
  virtual void check() const {}
  /// True if a flight of the scenario has to keep up with the wall clock for its sake.
  [[nodiscard]] virtual bool is_live(const Scenario& /*scenario*/) const { return false; }
  /// What it needs of the scenario, which is flown at `rate` simulated seconds per second (0: as
  /// fast as it goes). Throws InputError.
  virtual void prepare(Scenario& /*scenario*/, double /*rate*/) {}
  /// Where vehicles start, in the map that is flown in.
  virtual void place(Scenario& /*scenario*/,
                     const std::shared_ptr<const SurfelMap>& /*map*/) const {}
  /// So long its links may keep the run waiting for an answer, s; 0: they do not.
  [[nodiscard]] virtual double lockstep() const { return 0.0; }
  /// Opens what it writes to or listens to and adds its links to the loop; loop and simulation
  /// outlive the part. Throws InputError.
  virtual void connect(Simulation& /*simulation*/, RunLoop& /*loop*/) {}
  /// Lines for the user about what has become of it, after the run.
  virtual void report(const RunLoop& /*loop*/) const {}
  /// True if it did not get all of the run; `report` or it itself has said why.
  [[nodiscard]] virtual bool has_failed() const { return false; }
};

}  // namespace pointflight::apps
