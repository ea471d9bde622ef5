#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "pointflight/ros/common/timed_recording.hpp"
#include "pointflight/run/run_loop.hpp"
#include "pointflight/view/live_server.hpp"
#include "pointflight/view/order_inbox.hpp"

namespace pointflight {

/// Plays a recording to a server's clients as it lies there: its channels with their schemas, its
/// messages at their times. Clients pause, step (to the next large message: a scan, a picture), set
/// the pace and jump; after a jump they get what latched topics held then.
class RecordingPlayer {
 public:
  /// Makes the channels known. The recording outlives the player; the server's `range` is to be
  /// the recording's.
  RecordingPlayer(TimedRecording& recording, std::shared_ptr<LiveServer> server);
  /// Ends the server, whose thread calls this.
  ~RecordingPlayer();
  RecordingPlayer(const RecordingPlayer&) = delete;
  RecordingPlayer& operator=(const RecordingPlayer&) = delete;

  /// From the start, once somebody looks; at its end it stands still. Until `interrupted` says so.
  void play(const std::function<bool()>& interrupted);

 private:
  void take_orders();
  void obey(const Order& order);
  void play_on();
  void jump(SimTime to);
  /// Who comes while it stands still sees where it stands.
  void welcome();
  void stand_still();
  void send(const TimedMessage& message);
  void say(bool did_seek) const;
  [[nodiscard]] SimTime time_of(const TimedMessage& message) const;
  [[nodiscard]] std::int64_t stamp(SimTime time) const;

  TimedRecording& recording_;
  std::shared_ptr<LiveServer> server_;
  std::vector<std::uint32_t> channels_;  ///< The server's, by the recording's.
  SimTime end_;
  OrderInbox inbox_;
  Pace pace_{1.0};
  SimTime time_;                         ///< Reached.
  std::optional<TimedMessage> waiting_;  ///< The next one, not due yet.
  bool playing_ = true;
  bool step_once_ = false;
  bool ended_ = false;
  int subscriptions_ = 0;  ///< When it last looked.
  int welcomed_ = 0;       ///< Of them.
};

}  // namespace pointflight
