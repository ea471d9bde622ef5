#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "pointflight/sim/simulation.hpp"
#include "ros_common/description.hpp"
#include "ros_common/profile.hpp"

namespace pointflight {

/// What a profile's outputs can say; `OutputType::help` has each in words.
enum class OutputKind {
  kOdometry,
  kImu,
  kCloud,
  kCloudWorld,
  kMovingCloud,   ///< Points on the surfaces of obstacles.
  kVehicleCloud,  ///< Points on the hull of the other vehicle whose odometry came.
  kDepth,
  kCameraInfo,
  kPose,
  kCameraPose,  ///< The body's pose in optical axes, with odometry.
  kSensorPose,
  kPath,
  kTf,
  kTfScan,  ///< The sensor's pose with each scan.
  kTfStatic,
  kClock,
  kMap,
  kObstacles,
  kCollisions,
  kCollisionCloud,  ///< Points of the map that the hull touches.
  kModel,
  kVelocity,
  kTrajectory,
  kCovariance,
  kSensorModel,
  kLabel,
  kRotorSpeeds,
  kDiagnostics,
  kScanTime,
};

/// A row of the table of kinds.
struct OutputType {
  /// One message stream for the run, each vehicle or each LiDAR.
  enum class Per { kRun, kVehicle, kLidar };
  OutputKind kind = OutputKind::kOdometry;  ///< What it is about.
  const char* name = "";                    ///< In profiles.
  Per per = Per::kVehicle;                  ///< What there is one of each for.
  /// Its type in both ROSes.
  MessageType (*type)() = nullptr;
  const char* help = "";   ///< For `--help` and docs/ros.md; half a sentence.
  bool latched = false;    ///< Whoever comes late gets the last message.
  bool large = false;      ///< Paced on ROS 2.
  std::size_t depth = 10;  ///< Messages that a reader's queue should hold.
};

/// What the optical frame (z ahead, x right, y down) of a camera ends in.
inline constexpr const char* kOpticalSuffix = "_optical";

/// All kinds, in the order in which they are sent at one instant.
std::span<const OutputType> output_types();

/// One message stream of a run: an output of the profile for one vehicle or LiDAR.
struct OutputStream {
  const OutputType* type = nullptr;  ///< Its row of the table; never null.
  RosOutput settings;                ///< Names written out.
  Topic topic;                       ///< What an outlet is told of it.
  std::size_t vehicle = 0;           ///< Number in the fleet; 0 for what is of the run.
  std::size_t lidar = 0;             ///< On that vehicle; 0 for what is of no LiDAR.
};

/// Names of a vehicle's LiDARs, as ROS takes them: their model's, with a number where several are
/// alike.
std::vector<std::string> lidar_names(const VehicleAgent& vehicle);

/// The frames of a vehicle and of its LiDAR. Where the profile's pattern does not tell them apart,
/// the first keeps the name; others have their vehicle's in front and their LiDAR's behind.
std::string body_frame_of(const RosProfile& profile, const RosNames& names, std::size_t vehicle);
/// The sensor's own axes; in optical axes it ends in `kOpticalSuffix`.
std::string sensor_frame_of(const RosProfile& profile,
                            const RosNames& names,
                            std::size_t vehicle,
                            std::size_t lidar);

/// The streams of a profile in a run. Outputs with `{lidar}` in their topic have one for each
/// LiDAR; without it the first that fits (a camera for depth pictures). Throws InputError where two
/// streams have one topic but different types.
std::vector<OutputStream> output_streams(const Simulation& simulation, const RosProfile& profile);

/// Bytes a second of clouds and pictures if all are read and every beam returns.
double large_rate(const Simulation& simulation, const RosProfile& profile);

}  // namespace pointflight
