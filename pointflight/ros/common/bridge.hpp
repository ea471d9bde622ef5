#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <string>

#include "pointflight/ros/common/output.hpp"

namespace pointflight {

/// Hands a run's samples to the streams of a profile and their messages to outlets: ROS 1, ROS 2,
/// recordings. Knows clocks, readers and resets, and no kind of message; a message without readers
/// is not made. One thread.
class RosBridge : public SampleSink {
 public:
  /// Stamps count from `epoch` (since the Unix epoch). Throws InputError (a profile that cannot
  /// be).
  RosBridge(RunDescription run, const RosProfile& profile, Duration epoch);
  RosBridge(const RosBridge&) = delete;  // its streams know where it is
  RosBridge& operator=(const RosBridge&) = delete;

  /// Before `start`. The outlet must outlive the bridge.
  void add(Outlet& outlet);
  /// Before the first scan: `resend_scans` will be called.
  void keep_scans() { ros_.keeps_scans = true; }
  /// Makes all topics known and sends what is latched (map, static transforms) if somebody is
  /// there; later to the first who comes.
  void start();

  void on_sample(const Sample& sample) override;
  /// The run has reached a time: sends what follows the clock. Call after each step.
  void on_time(SimTime time);
  /// For a run that waits: the clock where it stands, transforms for those who have come
  /// meanwhile, what is latched.
  void on_wait(SimTime now);
  /// For a run that waits for an answer: the last scans once more for readers that have come since
  /// they were sent.
  void resend_scans();

  /// After a reset the run starts again at zero, but stamps go on.
  void shift_epoch(Duration by);
  /// As given, and shifted since.
  [[nodiscard]] Duration epoch() const { return ros_.epoch; }

  /// So many messages from outside were left out, and why the last one was: for diagnostics.
  void note_refused(std::uint64_t count, const std::string& last);
  /// How long the last scan took by the wall clock, s: for `scan_time`; recordings leave it at 0.
  void note_scan_time(double seconds);

  /// True while somebody gets scans.
  [[nodiscard]] bool has_scan_readers() const;

 private:
  void note_start();
  void send_obstacles();

  RosRun ros_;
  std::deque<OutputStream> streams_;
  std::optional<Sample> obstacles_;  ///< Of one instant, not sent yet.
  SimTime next_look_;                ///< For those who want what is latched.
};

}  // namespace pointflight
