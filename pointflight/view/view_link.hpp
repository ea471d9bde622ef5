#pragma once

#include <array>
#include <chrono>
#include <memory>
#include <optional>
#include <vector>

#include "pointflight/ros/common/map_frame.hpp"
#include "pointflight/run/link.hpp"
#include "pointflight/run/playback.hpp"
#include "pointflight/view/live_server.hpp"
#include "pointflight/view/order_inbox.hpp"

namespace pointflight {

/// What our page shows beside the map: the run as JSON on channels of its own, scans as clouds in
/// the world. Other clients of the protocol may read them as well.
///
/// Channels: `/pointflight/run` (latched: vehicles with their shapes, LiDARs, missions, map),
/// `/pointflight/state` (some 30 times a second of the wall clock: time, poses, speeds, clearance,
/// commands, obstacles), `/pointflight/events`, and `/pointflight/<vehicle>/<lidar>` for each
/// LiDAR. What clients publish on `/pointflight/order` (`page_order`) becomes orders of this link.
class ViewLink : public Link {
 public:
  /// Stamps count from `epoch`.
  ViewLink(std::shared_ptr<LiveServer> server, Duration epoch);
  /// Ends the server, whose thread calls this.
  ~ViewLink() override;

  /// Before `open`, for a run that is played back: clients' playback controls become orders.
  void let_play_back();
  /// Tells clients how the playback stands.
  void publish_playback(const PlaybackStatus& status);

  void open(const RunDescription& run) override;
  void on_sample(const Sample& sample) override;
  void on_step(const StepDone& step) override;
  void on_wait(SimTime now, Waiting why) override;
  std::vector<Order> take_orders() override;
  void on_reset(SimTime reached) override;
  void on_seek(SimTime to) override;
  void close() override;
  /// Who watches wants the run to go on when its mission is flown.
  [[nodiscard]] bool is_in_use() const override { return true; }

 private:
  using Clock = std::chrono::steady_clock;
  struct Vehicle {
    std::optional<StateSample> state;
    std::optional<StatusSample> status;
    std::vector<std::uint32_t> scans;  ///< Channels, by LiDAR.
  };
  [[nodiscard]] std::int64_t stamp(SimTime time) const;
  void publish_state(SimTime now, const char* doing);
  void publish_scan(const ScanSample& sample);
  void publish_event(SimTime time, std::size_t vehicle, const std::string& words);

  std::shared_ptr<LiveServer> server_;
  Duration epoch_;
  std::vector<Vehicle> vehicles_;
  std::vector<std::string> names_;
  std::optional<ObstacleSample> obstacles_;
  std::vector<MotionLimits> motions_;
  MapFrame map_frame_;  ///< Of scans.
  OrderInbox inbox_;
  std::uint32_t run_ = 0, state_ = 0, events_ = 0;  ///< Channels.
  Clock::time_point last_state_{};
  Clock::time_point last_rate_{};
  SimTime rate_from_;
  double real_time_factor_ = 0.0;
};

}  // namespace pointflight
