#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "pointflight/core/settings.hpp"
#include "pointflight/ros/common/ros_setup.hpp"
#include "pointflight/sim/scenario.hpp"

namespace pointflight {

/// What stamps count from.
enum class StampEpoch {
  kFixed,  ///< 1.7e9 s and the run's time.
  kNow     ///< The wall clock's time at the start.
};
/// Of odometry's velocities.
enum class TwistFrame {
  kBody,  ///< REP 105: the child frame.
  kWorld
};
/// Of accelerations.
enum class ImuUnit {
  kMps2,
  kG  ///< 9.80665 m/s^2, as Livox' driver sends.
};
/// What an accelerometer shows at rest.
enum class ImuGravity {
  kUp,   ///< +9.81 on z (REP 145).
  kDown  ///< MARSIM's a + g.
};

/// Names, frames and customs of a family of programs: `data/ros_profiles/<name>.yaml`.
struct RosProfile {
  std::string path;                   ///< Of the file, for messages.
  std::string title;                  ///< Whose names these are.
  std::string source;                 ///< Where they were read.
  std::string world_frame = "world";  ///< ENU, the map's own origin.
  std::string world_alias;            ///< Another name of it that goals and commands may have.
  std::string body_frame = "{vehicle}/base_link";   ///< The vehicle's, at its centre of mass.
  std::string sensor_frame = "{vehicle}/{lidar}";   ///< A LiDAR's own axes.
  std::int64_t first_id = 0;                        ///< `{id}` of the first vehicle.
  StampEpoch epoch = StampEpoch::kFixed;            ///< What stamps count from.
  TwistFrame twist = TwistFrame::kBody;             ///< Odometry's velocities.
  ImuUnit imu_unit = ImuUnit::kMps2;                ///< Of accelerations.
  ImuGravity imu_gravity = ImuGravity::kUp;         ///< Its sign in them.
  std::string livox_package = "livox_ros_driver2";  ///< ROS 1: of CustomMsg.
  /// How far its planner keeps from obstacles with the middle of the vehicle, m, by the program's
  /// own files; 0: not known, or no planner.
  double inflation = 0.0;
  std::vector<RosOutput> outputs;  ///< Each is one kind of message; several may be of one kind.
  /// Topics that are read; a shipped profile names what its programs send.
  std::vector<RosInput> inputs;
};

/// The one list of keys of a profile.
void describe(SettingsVisitor& visitor, RosProfile& profile);

/// Reads a profile by name ("marsim") or path; relative paths are taken from `base`.
RosProfile load_ros_profile(const std::string& name_or_path, const std::string& base = {});

/// From text, for tests and fuzzers.
RosProfile parse_ros_profile(std::string_view text, const std::string& path);

/// The profile that a scenario asks for (or `name`, if it is not empty) with the scenario's own
/// names in it. Throws InputError with file and line, also for vehicles' names that ROS does not
/// take.
RosProfile profile_for(const Scenario& scenario, const std::string& name = {});

/// True if it sends the run's clock, which nodes with use_sim_time live on.
bool has_clock(const RosProfile& profile);
/// Lets it send the clock.
void add_clock(RosProfile& profile);

/// What `{vehicle}`, `{id}` and `{lidar}` stand for.
struct RosNames {
  std::string vehicle;  ///< The vehicle's name in the scenario.
  std::int64_t id = 0;  ///< first_id + number.
  std::string lidar;    ///< As `lidar_names` has it; empty if a name is of no LiDAR.
};

/// Of a vehicle, without a LiDAR's.
RosNames names_of(const RosProfile& profile, const VehicleSetup& setup, std::size_t vehicle);

/// A vehicle's frame. Where the profile's pattern does not tell vehicles apart, the first keeps the
/// name; others have their own in front.
std::string body_frame_of(const RosProfile& profile, const RosNames& names, std::size_t vehicle);

/// False for a topic that is left open or switched off ("-").
bool is_used(const std::string& topic);

/// As frames are compared: tf of old wrote a leading /.
std::string bare_frame(const std::string& frame);

/// With a / in front.
std::string absolute(const std::string& topic);

/// True if a topic or frame is another for each vehicle.
bool names_vehicle(const std::string& pattern);

/// A topic or frame with its names written out.
std::string with_names(const std::string& pattern, const RosNames& names);

}  // namespace pointflight
