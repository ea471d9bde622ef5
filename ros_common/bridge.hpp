#pragma once

#include <cstdint>
#include <future>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "pointflight/sim/simulation.hpp"
#include "ros_common/outputs.hpp"
#include "ros_common/profile.hpp"
#include "ros_common/wire.hpp"

namespace pointflight {

/// Makes the messages of a profile from a run's samples and hands them to outlets: ROS 1, ROS 2,
/// recordings. Decides nothing else; a message without readers is not made. One thread.
class RosBridge : public SampleSink {
 public:
  /// Stamps count from `epoch` (since the Unix epoch). The simulation must outlive it. Throws
  /// InputError (a profile that cannot be).
  RosBridge(const Simulation& simulation, const RosProfile& profile, Duration epoch);
  ~RosBridge() override;

  /// Before `start`. The outlet must outlive the bridge.
  void add(Outlet& outlet);
  /// Before the first scan: `resend_scans` will be called.
  void keep_scans() { keeps_scans_ = true; }
  /// Makes all topics known and sends what is latched (map, static transforms) where somebody is
  /// there; later to the first who comes.
  void start();

  /// The run has reached a time: sends what follows the clock. Call after each step.
  void on_time(SimTime time);
  /// For a run that waits: the clock where it stands, transforms for those who have come
  /// meanwhile, what is latched.
  void repeat();
  /// For a run that waits for an answer: the last scans once more for readers that have come since
  /// they were sent.
  void resend_scans();
  void on_sample(const Sample& sample) override;

  /// After a reset the run starts again at zero, but stamps go on.
  void shift_epoch(Duration by);
  /// As given, and shifted since.
  [[nodiscard]] Duration epoch() const { return epoch_; }

  /// So many messages from outside were left out, and why the last one was: for diagnostics.
  void note_refused(std::uint64_t count, const std::string& last);

  /// How long the last scan took by the wall clock, s: for `scan_time`; recordings leave it at 0.
  void note_scan_time(double seconds);

  /// True while somebody gets scans.
  [[nodiscard]] bool has_scan_readers() const;
  /// The rate of odometry samples that the profile needs, Hz.
  [[nodiscard]] static double odometry_rate(const RosProfile& profile);

 private:
  struct Stream;

  [[nodiscard]] bool is_wanted(const Stream& stream) const;
  [[nodiscard]] int reader_count(const Stream& stream) const;
  /// True once, `calls` calls after a reader has come: it may not know of us at first.
  [[nodiscard]] bool has_newcomer(Stream& stream, int calls) const;
  [[nodiscard]] bool is_due(Stream& stream, SimTime time) const;
  template <class M>
  void send(Stream& stream, M message, SimTime leaves);
  void send_cloud(Stream& stream, const std::vector<Vector3f>& points, SimTime time);
  void send_latched();
  [[nodiscard]] msg::PointCloud2 map_message(const Stream& stream, Duration epoch) const;
  void send_static_transforms(Stream& stream);
  void send_transform(Stream& stream, const OdometrySample& sample);
  [[nodiscard]] OdometrySample last_state_of(std::size_t vehicle) const;
  void send_path(Stream& stream, const OdometrySample& sample);
  void send_markers(Stream& stream, const OdometrySample& sample);
  void send_obstacles();
  void on_odometry(const OdometrySample& sample);
  void on_imu(const ImuSample& sample);
  void on_scan(const ScanSample& sample);
  void on_collision(const CollisionEvent& event);
  void on_obstacle(const ObstacleSample& sample);
  void send_scan(Stream& stream, const ScanSample& sample);

  const Simulation& simulation_;
  RosProfile profile_;
  Duration epoch_;
  std::vector<Outlet*> outlets_;
  std::vector<std::unique_ptr<Stream>> streams_;
  std::vector<ObstacleSample> obstacles_;  ///< Of one instant, not sent yet.
  std::int32_t collisions_ = 0;
  std::vector<double> scan_times_;
  std::vector<std::optional<OdometrySample>> last_states_;  ///< Of each vehicle.
  bool keeps_scans_ = false;
  std::uint64_t refused_ = 0;
  std::string last_refused_;
  std::future<msg::PointCloud2> map_;  ///< In the making, for a reader that came late.
  SimTime next_latched_;               ///< When somebody is looked for who wants it.
  SimTime latest_;                     ///< That anything left at.
};

}  // namespace pointflight
