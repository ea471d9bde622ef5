// Plays a finished run from its folder: what was flown once can be published, shown or converted
// again, without flying.
#pragma once

#include <functional>
#include <span>

#include "pointflight/core/progress.hpp"
#include "pointflight/run/link.hpp"
#include "pointflight/run/recorded_run.hpp"

namespace pointflight {

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
  /// Called when it starts, stands still, goes on, jumps; if it is controlled.
  std::function<void(const PlaybackStatus&)> on_status;
};

/// Plays it from its start through links, which get what they got when it was flown: samples and
/// steps. Their orders are taken and not obeyed, but for `EndOrder` and, where it is controlled,
/// those that say when.
void play(RecordedRun& run, std::span<Link* const> links, const PlaybackOptions& options);

}  // namespace pointflight
