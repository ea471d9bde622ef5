#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "pointflight/ros/common/bridge.hpp"
#include "pointflight/ros/common/inputs.hpp"
#include "pointflight/ros/common/wire.hpp"
#include "pointflight/run/link.hpp"

namespace pointflight {

/// What stamps count from where nothing else is asked for: some ROS programs misread times near
/// zero.
inline constexpr Duration kFixedEpoch = std::chrono::seconds(1'700'000'000);

/// How ROS takes part in a run.
struct RosLinkOptions {
  Duration epoch = kFixedEpoch;  ///< Since the Unix epoch: what stamps count from.
  bool waits = true;             ///< The run starts when all transports have found their ROS...
  bool lockstep = false;         ///< ...and somebody reads scans and sends commands.
  bool needs_clock = false;  ///< Nodes live on the wall clock: it could not be slower than that.
  std::function<void(const std::string& line)> log;  ///< Lines for users.
  /// A transport could not be ended (`Transport::has_ended`).
  std::function<void()> on_left_behind;
};

/// ROS 1, ROS 2 and recordings of a run: messages out, orders in.
class RosLink : public Link {
 public:
  /// Throws InputError (a profile that cannot be).
  RosLink(const RunDescription& run, const RosProfile& profile, RosLinkOptions options);
  /// Ends the transports.
  ~RosLink() override;

  /// Before `open`: a ROS that is published to and listened to.
  void add_transport(std::unique_ptr<Transport> transport);
  /// Before `open`: a recording.
  void add_recording(std::unique_ptr<Outlet> recording);

  void open(const RunDescription& run) override;
  bool is_ready() override;
  void on_sample(const Sample& sample) override { bridge_.on_sample(sample); }
  void on_step(const StepDone& step) override;
  void on_wait(SimTime now, Waiting why) override;
  [[nodiscard]] bool wants_answer(const Sample& sample) const override {
    return options_.lockstep && std::holds_alternative<ScanSample>(sample);
  }
  std::vector<Order> take_orders() override;
  void on_reset(SimTime reached) override;
  void on_seek(SimTime to) override;
  void close() override;
  [[nodiscard]] bool is_over() const override;
  [[nodiscard]] std::string remedy_when_behind(double rate) const override;
  [[nodiscard]] bool is_in_use() const override { return in_use_; }
  [[nodiscard]] std::uint64_t dropped() const override;

  /// What its stamps count from, since the Unix epoch.
  [[nodiscard]] Duration epoch() const { return bridge_.epoch(); }
  /// How many recordings it has.
  [[nodiscard]] std::size_t recordings() const { return recordings_.size(); }
  /// True if a recording, counted as they were added, could not be written to its end; it was
  /// said.
  [[nodiscard]] bool has_failed(std::size_t recording) const;

 private:
  struct StoredOutlet {
    std::unique_ptr<Outlet> outlet;
    bool told = false;  ///< That it has failed.
  };
  [[nodiscard]] bool has_planner() const;
  void say_failed_recordings();
  void say_refused();
  void close_transports();

  RosLinkOptions options_;
  std::vector<StoredOutlet> recordings_;
  Inbox inbox_;  ///< Outlives the transports, whose threads fill it.
  std::vector<std::unique_ptr<Transport>> transports_;
  RosBridge bridge_;
  int settled_ = 0;  ///< Looks since a planner is there.
  bool said_waiting_ = false;
  bool awaits_planner_ = false;      ///< In lockstep; all transports have found their ROS.
  std::atomic<bool> in_use_ = true;  ///< Asked from any thread.
  std::uint64_t told_refused_ = 0;
};

}  // namespace pointflight
