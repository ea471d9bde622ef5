// Plays a finished run from its folder: what was flown once can be published, shown or converted
// again, without flying.
#pragma once

#include <functional>
#include <memory>
#include <span>
#include <string>

#include "pointflight/core/parallel.hpp"
#include "pointflight/core/progress.hpp"
#include "pointflight/run/link.hpp"

namespace pointflight {

/// A run as its folder has it: states, odometry, IMU and own sensors from their CSV files, scans
/// from their PCDs, collisions and obstacles. What the scenario did not write is not there.
class RecordedRun {
 public:
  /// Opens the folder's scenario and map. Throws InputError with file and line where something is
  /// missing or cannot be read. The executor must outlive it.
  RecordedRun(const std::string& folder, const Executor& executor);
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

/// How a playback stands.
struct PlaybackStatus {
  SimTime time;           ///< Reached.
  bool playing = true;    ///< False: it stands still.
  bool ended = false;     ///< At the run's end.
  double rate = 0.0;      ///< As `PlaybackOptions`.
  bool did_seek = false;  ///< It jumped there.
};

/// How a recorded run is played.
struct PlaybackOptions {
  double rate = 0.0;                  ///< Recorded seconds per second; 0: as fast as it goes.
  Progress progress;                  ///< Of the run's length.
  std::function<bool()> interrupted;  ///< True once the user wants it to end.
  /// Pause, step, rate and seek are obeyed, and at its end it stands still until it is interrupted.
  bool controlled = false;
  /// Called when it starts, stands still, goes on, jumps; where it is controlled.
  std::function<void(const PlaybackStatus&)> on_status;
};

/// Plays it from its start through links, which get what they got when it was flown: samples and
/// steps. Their orders are taken and not obeyed, but for `EndOrder` and, where it is controlled,
/// those that say when.
void play(RecordedRun& run, std::span<Link* const> links, const PlaybackOptions& options);

}  // namespace pointflight
