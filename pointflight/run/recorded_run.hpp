// A finished run, read from its folder.
#pragma once

#include <memory>
#include <string>

#include "pointflight/core/parallel.hpp"
#include "pointflight/sim/run_description.hpp"
#include "pointflight/sim/simulation.hpp"

namespace pointflight {

/// What a run's folder was written by, for `RecordedRun`: its scenario and map are opened. Throws
/// InputError. The executor must outlive it.
std::shared_ptr<const Simulation> simulation_of_run(const std::string& folder,
                                                    const Executor& executor);

/// A run as its folder has it: states, odometry, IMU and own sensors from their CSV files, scans
/// from their PCDs, collisions and obstacles. What the scenario did not write is not there.
class RecordedRun {
 public:
  /// Opens the folder's scenario and map. Throws InputError with file and line where something is
  /// missing or cannot be read. The executor must outlive it.
  RecordedRun(const std::string& folder, const Executor& executor);
  /// The same by a simulation that has been made already, of the folder's own scenario: runs of one
  /// scenario may share it.
  RecordedRun(const std::string& folder,
              std::shared_ptr<const Simulation> simulation,
              const Executor& executor);
  ~RecordedRun();
  RecordedRun(const RecordedRun&) = delete;
  RecordedRun& operator=(const RecordedRun&) = delete;

  /// What links are told at the start.
  [[nodiscard]] const RunDescription& description() const;
  /// When it ended.
  [[nodiscard]] SimTime end() const;
  /// Between two instants that samples come at.
  [[nodiscard]] Duration step() const;

  /// To be played from its start again.
  void rewind() { seek(SimTime{}); }
  /// To be played on from the step that starts at `time` or before it.
  void seek(SimTime time);
  /// Samples that came in the step that starts at `time`, in the order in which they came. Steps
  /// are asked for one after the other. Throws InputError.
  void play_step(SimTime time, SampleSink& sink);

 private:
  struct Files;
  std::unique_ptr<Files> files_;
};

}  // namespace pointflight
