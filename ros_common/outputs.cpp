#include "ros_common/outputs.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <map>

#include "pointflight/core/input_error.hpp"
#include "ros_common/point_layout.hpp"
#include "ros_common/ros_names.hpp"
#include "ros_common/scan_messages.hpp"

namespace pointflight {
namespace {

using Per = OutputType::Per;

template <class M>
MessageType type_of() {
  static const MessageType type = message_type<M>();
  return type;
}

// lockstep runs in bursts: what comes between two scans must fit
constexpr std::size_t kImuDepth = 200;  // a second: those who integrate must not lose one

constexpr OutputType kTypes[] = {
    {OutputKind::kClock,
     "clock",
     Per::kRun,
     type_of<msg::Clock>,
     "simulated time",
     false,
     false,
     1},
    {OutputKind::kMap,
     "map",
     Per::kRun,
     type_of<msg::PointCloud2>,
     "the map's points, latched",
     true,
     true,
     1},
    {OutputKind::kTfStatic,
     "tf_static",
     Per::kRun,
     type_of<msg::TFMessage>,
     "sensors on their vehicles, latched",
     true,
     false,
     1},
    {OutputKind::kImu,
     "imu",
     Per::kVehicle,
     type_of<msg::Imu>,
     "gyroscope and accelerometer, true attitude",
     false,
     false,
     kImuDepth},
    {OutputKind::kTf,
     "tf",
     Per::kVehicle,
     type_of<msg::TFMessage>,
     "the vehicle in the world",
     false,
     false,
     100},
    {OutputKind::kOdometry,
     "odometry",
     Per::kVehicle,
     type_of<msg::Odometry>,
     "true pose and velocities",
     false,
     false,
     100},
    {OutputKind::kPose, "pose", Per::kVehicle, type_of<msg::PoseStamped>, "true pose"},
    {OutputKind::kCameraPose,
     "camera_pose",
     Per::kVehicle,
     type_of<msg::PoseStamped>,
     "true pose with optical axes"},
    {OutputKind::kPath, "path", Per::kVehicle, type_of<msg::Path>, "where it flew"},
    {OutputKind::kRotorSpeeds,
     "rotor_speeds",
     Per::kVehicle,
     type_of<msg::Float32MultiArray>,
     "of the rotors, rpm"},
    {OutputKind::kModel, "model", Per::kVehicle, type_of<msg::Marker>, "the vehicle's hull"},
    {OutputKind::kVelocity, "velocity", Per::kVehicle, type_of<msg::Marker>, "an arrow"},
    {OutputKind::kTrajectory, "trajectory", Per::kVehicle, type_of<msg::Marker>, "the flown line"},
    {OutputKind::kCovariance, "covariance", Per::kVehicle, type_of<msg::Marker>, "of a pose: none"},
    {OutputKind::kSensorModel, "sensor_model", Per::kVehicle, type_of<msg::Marker>, "the LiDAR"},
    {OutputKind::kLabel, "label", Per::kVehicle, type_of<msg::Marker>, "the vehicle's name"},
    {OutputKind::kVehicleCloud,
     "vehicle_cloud",
     Per::kVehicle,
     type_of<msg::PointCloud2>,
     "points on the hull of the other vehicle whose odometry came",
     false,
     true,
     5},
    {OutputKind::kCollisionCloud,
     "collision_cloud",
     Per::kVehicle,
     type_of<msg::PointCloud2>,
     "points of the map that the vehicle's hull touches"},
    {OutputKind::kTfScan,
     "tf_scan",
     Per::kLidar,
     type_of<msg::TFMessage>,
     "the sensor in the world, with each scan",
     false,
     false,
     100},
    {OutputKind::kSensorPose,
     "sensor_pose",
     Per::kLidar,
     type_of<msg::PoseStamped>,
     "the sensor's pose with each scan, optical axes"},
    {OutputKind::kCloud,
     "cloud",
     Per::kLidar,
     type_of<msg::PointCloud2>,
     "a scan in the sensor's frame",
     false,
     true,
     5},
    {OutputKind::kCloudWorld,
     "cloud_world",
     Per::kLidar,
     type_of<msg::PointCloud2>,
     "a scan in the world",
     false,
     true,
     5},
    {OutputKind::kDepth,
     "depth",
     Per::kLidar,
     type_of<msg::Image>,
     "depth picture, 32FC1",
     false,
     true,
     5},
    {OutputKind::kCameraInfo,
     "camera_info",
     Per::kLidar,
     type_of<msg::CameraInfo>,
     "camera matrix of a depth camera"},
    {OutputKind::kMovingCloud,
     "moving_cloud",
     Per::kVehicle,
     type_of<msg::PointCloud2>,
     "points on the surfaces of obstacles",
     false,
     true,
     5},
    {OutputKind::kObstacles,
     "obstacles",
     Per::kRun,
     type_of<msg::MarkerArray>,
     "obstacles as shapes"},
    {OutputKind::kCollisions,
     "collisions",
     Per::kRun,
     type_of<msg::MarkerArray>,
     "where vehicles met something"},
    {OutputKind::kScanTime,
     "scan_time",
     Per::kVehicle,
     type_of<msg::PoseStamped>,
     "position.x: mean seconds that the last 21 scans took"},
    {OutputKind::kDiagnostics,
     "diagnostics",
     Per::kRun,
     type_of<msg::DiagnosticArray>,
     "each vehicle's state in words, once a second"},
};

/// The LiDAR that an output without `{lidar}` is about: the first, or the first camera.
std::size_t chosen_lidar(const VehicleAgent& vehicle, const OutputType& type) {
  const bool wants_camera = type.kind == OutputKind::kDepth || type.kind == OutputKind::kCameraInfo;
  const auto& lidars = vehicle.lidars();
  for (std::size_t l = 0; l < lidars.size(); ++l) {
    if (is_camera(lidars[l]->lidar().settings()) == wants_camera) return l;
  }
  return 0;
}

}  // namespace

std::span<const OutputType> output_types() {
  return kTypes;
}

std::vector<std::string> lidar_names(const VehicleAgent& vehicle) {
  std::vector<std::string> names;
  std::map<std::string, int> seen;
  for (const LidarMount& mount : vehicle.setup().lidars) {
    const std::string stem = as_ros_word(std::filesystem::path(mount.model).stem().string());
    const int before = seen[stem]++;
    names.push_back(before == 0 ? stem : fmt::format("{}_{}", stem, before));
  }
  return names;
}

std::string body_frame_of(const RosProfile& profile, const RosNames& names, std::size_t vehicle) {
  const bool apart = vehicle == 0 || names_vehicle(profile.body_frame);
  return (apart ? "" : names.vehicle + "/") + with_names(profile.body_frame, names);
}

std::string sensor_frame_of(const RosProfile& profile,
                            const RosNames& names,
                            std::size_t vehicle,
                            std::size_t lidar) {
  const std::string& pattern = profile.sensor_frame;
  const bool vehicles_apart = vehicle == 0 || names_vehicle(pattern);
  const bool lidars_apart = lidar == 0 || pattern.find("{lidar}") != std::string::npos;
  return (vehicles_apart ? "" : names.vehicle + "/") + with_names(pattern, names) +
         (lidars_apart ? "" : "_" + names.lidar);
}

namespace {

/// Writes an output of a profile out for the vehicles and LiDARs of a run.
class StreamMaker {
 public:
  StreamMaker(const Simulation& simulation, const RosProfile& profile)
      : simulation_(simulation), profile_(profile) {}

  void add(const RosOutput& output, const OutputType& type) {
    if (type.per == Per::kRun) {
      add_stream(output, type, {}, 0, 0);
      return;
    }
    const bool vehicles_apart = names_vehicle(output.topic);
    for (std::size_t v = 0; v < simulation_.vehicle_count(); ++v) {
      // one name for all can only be one vehicle's, but for transforms, which name their frames
      if (v > 0 && !vehicles_apart && !is_transform(type)) return;
      RosNames names;
      names.vehicle = simulation_.vehicle(v).setup().name;
      names.id = profile_.first_id + static_cast<std::int64_t>(v);
      if (type.per == Per::kVehicle) {
        add_stream(output, type, names, v, 0);
      } else {
        add_for_lidars(output, type, names, v);
      }
    }
  }

  [[nodiscard]] std::vector<OutputStream> take() { return std::move(streams_); }

 private:
  static bool is_transform(const OutputType& type) {
    return type.kind == OutputKind::kTf || type.kind == OutputKind::kTfScan;
  }

  void add_for_lidars(const RosOutput& output,
                      const OutputType& type,
                      RosNames names,
                      std::size_t vehicle) {
    const VehicleAgent& agent = simulation_.vehicle(vehicle);
    const auto lidars = lidar_names(agent);
    const std::string& pattern = is_transform(type) ? output.child_frame : output.topic;
    const bool each = pattern.find("{lidar}") != std::string::npos;
    const std::size_t chosen = chosen_lidar(agent, type);
    for (std::size_t l = 0; l < lidars.size(); ++l) {
      if (!each && l != chosen) continue;
      const bool camera = is_camera(agent.lidars()[l]->lidar().settings());
      // a LiDAR has a depth picture only where one is asked for by name
      if (type.kind == OutputKind::kCameraInfo && !camera) continue;
      if (type.kind == OutputKind::kDepth && each && !camera) continue;
      names.lidar = lidars[l];
      add_stream(output, type, names, vehicle, l);
    }
  }

  void add_stream(const RosOutput& output,
                  const OutputType& type,
                  const RosNames& names,
                  std::size_t vehicle,
                  std::size_t lidar) {
    OutputStream stream;
    stream.type = &type;
    stream.settings = output;
    stream.vehicle = vehicle;
    stream.lidar = lidar;
    RosOutput& s = stream.settings;
    if (s.frame.empty()) s.frame = frame_for(type, vehicle, lidar);
    if (s.child_frame.empty()) {
      s.child_frame =
          type.kind == OutputKind::kTfScan ? profile_.sensor_frame : profile_.body_frame;
    }
    const auto written_out = [&](const std::string& frame) {
      const bool camera = frame == profile_.sensor_frame + kOpticalSuffix;
      if (frame == profile_.sensor_frame || camera) {
        return sensor_frame_of(profile_, names, vehicle, lidar) + (camera ? kOpticalSuffix : "");
      }
      return frame == profile_.body_frame ? body_frame_of(profile_, names, vehicle)
                                          : with_names(frame, names);
    };
    s.frame = written_out(s.frame);
    s.child_frame = s.child_frame == "-" ? "" : written_out(s.child_frame);
    s.topic = with_names(s.topic, names);
    if (s.topic.front() != '/') s.topic.insert(0, "/");
    if (s.layout.empty()) s.layout = type.kind == OutputKind::kCloud ? "xyzit" : "xyzi";
    MessageType message = type.type();
    if (s.layout == "livox_custom") {
      message = type_of<msg::CustomMsg>();
      message.package = profile_.livox_package;
    }
    const auto [known, is_new] = types_.try_emplace(s.topic, message.ros1_name());
    if (!is_new && known->second != message.ros1_name()) {
      throw InputError(fmt::format("{}: topic {} would carry both {} and {}; give one another name",
                                   profile_.path,
                                   s.topic,
                                   known->second,
                                   message.ros1_name()));
    }
    stream.topic = {s.topic, std::move(message), type.latched, type.depth, type.large};
    streams_.push_back(std::move(stream));
  }

  /// The profile's own frame for a kind.
  [[nodiscard]] std::string frame_for(const OutputType& type,
                                      std::size_t vehicle,
                                      std::size_t lidar) const {
    switch (type.kind) {
      case OutputKind::kImu:
        return profile_.body_frame;
      case OutputKind::kCloud:
        return profile_.sensor_frame;
      case OutputKind::kDepth:
      case OutputKind::kCameraInfo: {
        const MountedLidar& mounted = *simulation_.vehicle(vehicle).lidars()[lidar];
        const bool camera = is_camera(mounted.lidar().settings());
        return profile_.sensor_frame + (camera ? kOpticalSuffix : "");
      }
      default:
        return profile_.world_frame;
    }
  }

  const Simulation& simulation_;
  const RosProfile& profile_;
  std::vector<OutputStream> streams_;
  std::map<std::string, std::string> types_;  ///< Of each topic.
};

}  // namespace

std::vector<OutputStream> output_streams(const Simulation& simulation, const RosProfile& profile) {
  StreamMaker maker(simulation, profile);
  for (const OutputType& type : kTypes) {
    for (const RosOutput& output : profile.outputs) {
      const bool sent = !output.topic.empty() && output.topic != "-";
      if (output.kind == type.name && sent) maker.add(output, type);
    }
  }
  return maker.take();
}

double large_rate(const Simulation& simulation, const RosProfile& profile) {
  const Executor executor(1);
  double rate = 0.0;
  for (const OutputStream& stream : output_streams(simulation, profile)) {
    const OutputKind kind = stream.type->kind;
    const bool cloud = kind == OutputKind::kCloud || kind == OutputKind::kCloudWorld;
    if (!cloud && kind != OutputKind::kDepth) continue;
    const RosOutput& s = stream.settings;
    constexpr double kCustomPoint = 20.0;
    constexpr double kPixel = 4.0;
    const double bytes = !cloud                       ? kPixel
                         : s.layout == "livox_custom" ? kCustomPoint
                                                      : point_layout(s.layout).step;
    const Lidar& lidar = simulation.vehicle(stream.vehicle).lidars()[stream.lidar]->lidar();
    const double scans = lidar.settings().rate;
    rate += (s.rate > 0.0 ? std::min(scans, s.rate) : scans) * bytes *
            static_cast<double>(lidar.beams(0, executor).size());
  }
  return rate;
}

}  // namespace pointflight
