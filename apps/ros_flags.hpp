#pragma once

#include <CLI/App.hpp>
#include <memory>
#include <string>
#include <vector>

#include "ros_common/ros_link.hpp"
#include "view/live_server.hpp"

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
  bool stay = false;                 ///< Hover when the mission is flown.
  bool no_stay = false;              ///< End with the mission.
  double lockstep = 0.0;             ///< Wait so long for an answer to each scan, s; 0: not at all.
  std::vector<std::string> records;  ///< Files.
  std::string compression = "zstd";
  bool overwrite = false;  ///< Recordings that are there already.

  bool view = false;  ///< Somebody watches by the protocol of Foxglove (`ViewFlags`).

  /// Others' nodes may listen and command.
  [[nodiscard]] bool has_ros() const { return ros1 || ros2; }
  /// Somebody outside may listen and command.
  [[nodiscard]] bool is_live() const { return has_ros() || view; }
  [[nodiscard]] bool any() const { return is_live() || !records.empty(); }
};

void add_ros_flags(CLI::App& app, RosFlags& flags);

/// Throws InputError for a flag that has no effect without others.
void check_ros_flags(const RosFlags& flags);

/// What a profile needs of a scenario: samples as often as it sends them. A live flight goes on
/// until it is interrupted where nobody has planned it, and after its mission where it is flown in
/// real time (`rate` > 0) and not told to end (--no-stay, a duration, lockstep). Throws InputError.
void prepare_for_ros(const RosFlags& flags, double rate, Scenario& scenario);

/// ROS, recordings and viewers (those of `view`, if any) as a link, as the flags ask for, with
/// everything open; null where they ask for none. Throws InputError.
std::unique_ptr<RosLink> make_ros_link(const RosFlags& flags,
                                       const Simulation& simulation,
                                       const std::shared_ptr<LiveServer>& view);

/// Says which recordings were made and how large they are.
void say_recordings(const RosFlags& flags, const RosLink& link);

/// True where some recording could not be written to its end; it was said.
bool has_failed_recording(const RosLink& link);

}  // namespace pointflight::apps
