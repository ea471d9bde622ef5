#pragma once

#include <string>
#include <vector>

#include "pointflight/sim/scenario.hpp"

namespace pointflight {

/// A message that goes out, and under which name. In names and frames `{id}` stands for the
/// vehicle's number as the profile counts, `{vehicle}` for its name, `{lidar}` for its LiDAR's.
struct RosOutput {
  std::string kind;         ///< What it says: pointflight/ros/common/outputs.cpp has the list.
  std::string topic;        ///< "-": not sent.
  std::string frame;        ///< header.frame_id; empty: what the profile calls it.
  std::string child_frame;  ///< Of odometry and transforms; "-": none.
  double rate = -1.0;       ///< Hz at most; 0: each sample; -1: as the profile has it, or each.
  std::string layout;       ///< Of clouds.
  double resolution = 0.0;  ///< Of the map's cloud, m; 0: the map's own.
  bool organized = false;   ///< Of a LiDAR's clouds: rows and columns, NaN without a return.
};

/// Of rotor speeds: rad/s or rpm.
enum class RotorUnit { kSi, kRpm };
/// Of velocities.
enum class VelocityFrame { kWorld, kBody };
/// That defines PositionCommand.
enum class CommandPackage { kQuadrotorMsgs, kMarsQuadrotorMsgs };

/// A message that comes in.
struct RosInput {
  std::string kind;   ///< Kind of command: a row of pointflight/ros/common/inputs.cpp.
  std::string topic;  ///< "-": not read.
  RotorUnit unit = RotorUnit::kSi;              ///< Of rotor speeds.
  VelocityFrame frame = VelocityFrame::kWorld;  ///< Of velocities that name no frame.
  /// Of a PositionCommand on ROS 2, if readers of different types do not meet.
  CommandPackage package = CommandPackage::kQuadrotorMsgs;
};

/// The keys of one entry of `ros.outputs`.
void describe(SettingsVisitor& visitor, RosOutput& output);
/// The keys of one entry of `ros.inputs`.
void describe(SettingsVisitor& visitor, RosInput& input);

/// A scenario's `ros`: for ROS 1, ROS 2 and recordings.
struct RosSetup {
  std::string profile = "default";  ///< A shipped one, or a path.
  std::string epoch;                ///< "now", or seconds since 1970; empty: the profile's.
  std::string world_alias;          ///< Empty: the profile's.
  /// Of each kind that is named here, instead of the profile's; what is left open is the profile's.
  std::vector<RosOutput> outputs;
  std::vector<RosInput> inputs;  ///< As `outputs`, for what comes in.
};

/// The keys of `ros`.
void describe(SettingsVisitor& visitor, RosSetup& setup);

/// What a scenario says of ROS; the defaults if it says nothing.
const RosSetup& ros_setup_of(const Scenario& scenario);
/// The same, to be changed by a program.
RosSetup& ros_setup_of(Scenario& scenario);

}  // namespace pointflight
