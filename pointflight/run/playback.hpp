// Plays what was recorded once, without flying: it can be published, shown or converted again.
#pragma once

#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "pointflight/core/progress.hpp"
#include "pointflight/run/link.hpp"
#include "pointflight/run/recorded_run.hpp"

namespace pointflight {

/// How a playback stands.
struct PlaybackStatus {
  SimTime time;           ///< Reached.
  bool playing = true;    ///< False: it stands still.
  bool ended = false;     ///< At its end.
  double rate = 0.0;      ///< As `PlaybackOptions`.
  bool did_seek = false;  ///< It jumped there.
};

/// What can be played from any instant on: a run's folder, a recording.
class Playable {
 public:
  virtual ~Playable() = default;
  /// It goes from zero to here.
  [[nodiscard]] virtual SimTime end() const = 0;
  /// When what comes next is due; nothing after the last.
  [[nodiscard]] virtual std::optional<SimTime> next_due() = 0;
  /// Hands it on. True if it was what viewers step to: a scan.
  virtual bool play_next() = 0;
  /// Hands on what holds at `to`; what comes next is later.
  virtual void seek(SimTime to) = 0;
  /// It plays and has come to `now`.
  virtual void on_time(SimTime /*now*/) {}
  /// It stands still; some 50 times per second.
  virtual void on_wait(SimTime /*now*/) {}
  /// It starts, stands still, goes on, is about to jump; if it is controlled.
  virtual void on_status(const PlaybackStatus& /*status*/) {}
  /// All since the last call, in the order in which they came.
  virtual std::vector<Order> take_orders() = 0;
  /// True once after somebody has come who needs to know how it stands.
  [[nodiscard]] virtual bool has_newcomers() { return false; }
  /// True once it has to end.
  [[nodiscard]] virtual bool is_over() const { return false; }
};

/// How something is played.
struct PlaybackOptions {
  double rate = 0.0;                  ///< Recorded seconds per second; 0: as fast as it goes.
  Progress progress;                  ///< Of its length.
  std::function<bool()> interrupted;  ///< True once the user wants it to end.
  /// Pause, step, rate and seek are obeyed, and at its end it stands still until it is interrupted.
  bool controlled = false;
  /// As `Playable::on_status`, of a run.
  std::function<void(const PlaybackStatus&)> on_status;
};

/// Plays something from its start. `EndOrder` is always obeyed.
void play(Playable& playable, const PlaybackOptions& options);

/// Plays a run from its start through links, which get what they got when it was flown: samples
/// and steps. Commands to vehicles are taken and not obeyed.
void play(RecordedRun& run, std::span<Link* const> links, const PlaybackOptions& options);

}  // namespace pointflight
