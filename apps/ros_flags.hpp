#pragma once

#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "apps/cli.hpp"
#include "apps/flight_part.hpp"
#include "apps/view_flags.hpp"
#include "pointflight/ros/common/ros_link.hpp"
#include "pointflight/run/threaded_link.hpp"
#include "pointflight/view/live_server.hpp"
#include "pointflight/view/view_link.hpp"

namespace pointflight::apps {

/// Flags of `fly` for ROS and recordings.
struct RosFlags {
  bool ros1 = false;
  bool ros2 = false;
  bool localhost = false;  ///< ROS 2: no other machine.
  std::string node = "pointflight";
  bool no_wait = false;              ///< Fly on without a master.
  std::string profile;               ///< Empty: the scenario's.
  std::string epoch;                 ///< Empty: the scenario's or profile's.
  bool sim_time = false;             ///< Send the clock, whatever the profile.
  bool stay = false;                 ///< Hover when the mission is flown.
  bool no_stay = false;              ///< End with the mission.
  double lockstep = 0.0;             ///< Wait so long for an answer to each scan, s; 0: not at all.
  std::vector<std::string> records;  ///< Files.
  std::string compression = "zstd";
  bool overwrite = false;  ///< Recordings that are there already.

  ViewFlags view;  ///< Somebody watches by the protocol of Foxglove.

  /// Others' nodes may listen and command.
  [[nodiscard]] bool has_ros() const { return ros1 || ros2; }
  /// Somebody outside may listen and command.
  [[nodiscard]] bool is_live() const { return has_ros() || view.is_asked(); }
  [[nodiscard]] bool any() const { return is_live() || !records.empty(); }
};

void add_ros_flags(CLI::App& app, RosFlags& flags);

/// ROS, recordings and viewers as a part of a flight, as the flags ask for; a thread of its own
/// encodes and sends.
class RosPart : public FlightPart {
 public:
  explicit RosPart(RosFlags flags) : flags_(std::move(flags)) {}
  void check() const override;
  [[nodiscard]] bool is_live(const Scenario& scenario) const override;
  /// Samples as often as the profile sends them. A live flight goes on until it is interrupted if
  /// nobody has planned it, and after its mission if it is flown in real time and not told to end
  /// (--no-stay, a duration, lockstep).
  void prepare(Scenario& scenario, double rate) override;
  void connect(Simulation& simulation, RunLoop& loop) override;
  /// Which recordings were made and how large they are, how late scans left, what lockstep waited
  /// for in vain.
  void report(const RunLoop& loop) const override;
  /// Some recording could not be written to its end.
  [[nodiscard]] bool has_failed() const override;

 private:
  void say_recordings() const;

  RosFlags flags_;
  double rate_ = 0.0;  ///< Of the run; 0: as fast as it goes.
  std::shared_ptr<LiveServer> server_;
  std::unique_ptr<RosLink> ros_;
  std::unique_ptr<ViewLink> view_;
  std::optional<ThreadedLink> thread_;  ///< Around `ros_`; ends before the others do.
};

}  // namespace pointflight::apps
