// Messages about each vehicle: transforms, odometry, IMU, markers for RViz.
#include "pointflight/core/constants.hpp"
#include "pointflight/ros/common/output_rows.hpp"
#include "pointflight/ros/common/scan_messages.hpp"

namespace pointflight {
namespace {

constexpr std::size_t kPathPosesMax = 2000;
constexpr double kHullSpacing = 0.1;  // m between points on a hull
constexpr double kRpm = 30.0 / kPi;   // of a rad/s
constexpr msg::ColorRGBA kVehicleColor{0.0f, 0.45f, 0.70f, 0.9f};

// lockstep runs in bursts: what comes between two scans must fit
constexpr std::size_t kImuDepth = 200;  // a second: those who integrate must not lose one

msg::Imu imu_message(const OutputStream& stream, const ImuSample& sample) {
  const RosProfile& profile = stream.ros.profile;
  return imu_of(sample,
                stream.of_vehicle().settings.imu,
                stream.header(sample.stamp),
                {profile.imu_unit == ImuUnit::kG, profile.imu_gravity == ImuGravity::kDown});
}

msg::Odometry odometry_message(const OutputStream& stream, const OdometrySample& sample) {
  msg::Odometry message = odometry_of(sample.state,
                                      stream.header(sample.time),
                                      stream.settings.child_frame,
                                      stream.ros.profile.twist == TwistFrame::kWorld);
  add_variance(message, sample.variance);
  return message;
}

msg::Odometry ground_truth_message(const OutputStream& stream, const OdometrySample& sample) {
  return odometry_of(sample.truth,
                     stream.header(sample.time),
                     stream.settings.child_frame,
                     stream.ros.profile.twist == TwistFrame::kWorld);
}

msg::PoseStamped pose_message(const OutputStream& stream, const OdometrySample& sample) {
  return {stream.header(sample.time), pose_of(sample.state.T_world_body())};
}

msg::PoseStamped camera_pose_message(const OutputStream& stream, const OdometrySample& sample) {
  Pose pose = sample.state.T_world_body();
  pose.rotation = optical(pose.rotation);
  return {stream.header(sample.time), pose_of(pose)};
}

msg::Float32MultiArray rotor_speeds(const OutputStream& /*stream*/, const OdometrySample& sample) {
  msg::Float32MultiArray speeds;
  for (const double w : sample.rotor_commands) speeds.data.push_back(static_cast<float>(w * kRpm));
  return speeds;
}

/// The vehicle in the world; also for those who come while the run waits.
class Transform : public Output {
 public:
  using Output::Output;
  void on_sample(const Sample& sample) override {
    const auto* odometry = std::get_if<OdometrySample>(&sample);
    if (odometry == nullptr || !stream_.is_about(*odometry)) return;
    last_ = *odometry;
    if (stream_.is_due(odometry->delivered)) send(*odometry);
  }
  void on_wait(SimTime /*now*/) override {
    constexpr int kCalls = 10;
    if (!stream_.has_newcomer(kCalls)) return;
    OdometrySample start;
    start.state = stream_.of_vehicle().at_start.state;
    send(last_.value_or(start));
  }
  void on_restart() override { last_.reset(); }

 private:
  void send(const OdometrySample& sample) {
    stream_.note_served();
    stream_.send(msg::TFMessage{{transform_of(sample.truth.T_world_body(),
                                              stream_.header(sample.time),
                                              stream_.settings.child_frame)}},
                 sample.delivered);
  }
  std::optional<OdometrySample> last_;
};

/// The other one's hull, as this one would see it.
class VehicleCloud : public Output {
 public:
  using Output::Output;
  void on_sample(const Sample& sample) override {
    const auto* odometry = std::get_if<OdometrySample>(&sample);
    if (odometry == nullptr || stream_.is_about(*odometry)) return;
    if (!stream_.is_due(odometry->delivered)) return;
    std::vector<Vector3f> points;
    append_surface(stream_.ros.run.vehicles[odometry->vehicle].shape,
                   stream_.in_frame(odometry->state.T_world_body()),
                   kHullSpacing,
                   points);
    stream_.send(points_message(stream_, points, odometry->time), odometry->time);
  }
};

/// Points of the map that the hull touches.
class TouchedPoints : public Output {
 public:
  using Output::Output;
  void on_sample(const Sample& sample) override {
    const auto* odometry = std::get_if<OdometrySample>(&sample);
    if (odometry == nullptr || !stream_.is_about(*odometry)) return;
    if (!stream_.is_due(odometry->delivered)) return;
    const auto points = touched_points(*stream_.ros.run.map,
                                       stream_.of_vehicle().hull,
                                       odometry->state.T_world_body(),
                                       stream_.frame_origin());
    stream_.send(points_message(stream_, points, odometry->time), odometry->time);
  }
};

using Poses = std::vector<msg::PoseStamped>;

/// Where it flew, by `message(stream, sample, poses)`; a long path is thinned and stays small.
template <auto message>
class FlownPath : public Output {
 public:
  using Output::Output;
  void on_sample(const Sample& sample) override {
    const auto* odometry = std::get_if<OdometrySample>(&sample);
    if (odometry == nullptr || !stream_.is_about(*odometry)) return;
    add(stream_.header(odometry->time), odometry->state.T_world_body());
    if (!stream_.is_due(odometry->delivered)) return;
    stream_.send(message(stream_, *odometry, poses_), odometry->delivered);
  }
  void on_restart() override { poses_.clear(); }

 private:
  void add(const msg::Header& header, const Pose& pose) {
    const bool is_near =
        !poses_.empty() &&
        (vector_of(poses_.back().pose.position) - pose.translation).norm() < spacing_;
    if (is_near) return;
    poses_.push_back({header, pose_of(pose)});
    if (poses_.size() <= kPathPosesMax) return;
    for (std::size_t i = 0; 2 * i < poses_.size(); ++i) poses_[i] = poses_[2 * i];
    poses_.resize((poses_.size() + 1) / 2);
    spacing_ *= 2.0;
  }
  Poses poses_;
  double spacing_ = 0.1;  ///< m between poses.
};

msg::Path path_message(const OutputStream& stream,
                       const OdometrySample& sample,
                       const Poses& flown) {
  return {stream.header(sample.time), flown};
}

/// The hull.
msg::Marker model_marker(const OutputStream& stream, const OdometrySample& sample) {
  return marker_of(stream.of_vehicle().hull,
                   sample.truth.T_world_body(),
                   stream.header(sample.time),
                   stream.type.name,
                   static_cast<std::int32_t>(sample.vehicle),
                   kVehicleColor);
}

msg::Marker trajectory_marker(const OutputStream& stream,
                              const OdometrySample& sample,
                              const Poses& flown) {
  msg::Marker marker = model_marker(stream, sample);
  marker.type = msg::Marker::LINE_STRIP;
  marker.pose = {};
  marker.scale = {0.05, 0.0, 0.0};
  for (const auto& entry : flown) marker.points.push_back(entry.pose.position);
  return marker;
}

msg::Marker velocity_marker(const OutputStream& stream, const OdometrySample& sample) {
  msg::Marker marker = model_marker(stream, sample);
  marker.type = msg::Marker::ARROW;
  marker.pose = {};
  marker.scale = {0.05, 0.1, 0.1};  // shaft, head, head's length
  marker.points = {point_of(sample.truth.p_world),
                   point_of(Vector3d(sample.truth.p_world + 0.5 * sample.truth.v_world))};
  return marker;
}

/// Of the truth: a point.
msg::Marker covariance_marker(const OutputStream& stream, const OdometrySample& sample) {
  msg::Marker marker = model_marker(stream, sample);
  marker.type = msg::Marker::SPHERE;
  marker.scale = {1e-3, 1e-3, 1e-3};
  return marker;
}

msg::Marker sensor_marker(const OutputStream& stream, const OdometrySample& sample) {
  msg::Marker marker = model_marker(stream, sample);
  const auto& lidars = stream.of_vehicle().lidars;
  marker.type = msg::Marker::CYLINDER;
  if (!lidars.empty()) marker.pose = pose_of(sample.truth.T_world_body() * lidars[0].T_body_sensor);
  marker.scale = {0.08, 0.08, 0.06};
  return marker;
}

msg::Marker label_marker(const OutputStream& stream, const OdometrySample& sample) {
  msg::Marker marker = model_marker(stream, sample);
  marker.type = msg::Marker::TEXT_VIEW_FACING;
  marker.pose.position.z += 0.5;
  marker.scale = {0.0, 0.0, 0.3};
  marker.text = stream.of_vehicle().setup.name;
  return marker;
}

}  // namespace

std::vector<OutputType> vehicle_outputs() {
  return {
      {.name = "imu",
       .help = "gyroscope and accelerometer, true attitude",
       .make = per_sample<imu_message>(),
       .frame = OutputType::Frame::kImu,
       .depth = kImuDepth},
      {.name = "tf",
       .help = "the vehicle in the world",
       .make = made_by<Transform, msg::TFMessage>(),
       .sets_odometry_rate = true,
       .has_child = true,
       .is_transform = true,
       .depth = 100},
      {.name = "odometry",
       .help = "pose and velocities as the vehicle's odometry has them",
       .make = per_sample<odometry_message>(),
       .sets_odometry_rate = true,
       .has_child = true,
       .depth = 100},
      {.name = "ground_truth",
       .help = "true pose and velocities",
       .make = per_sample<ground_truth_message>(),
       .sets_odometry_rate = true,
       .has_child = true,
       .depth = 100},
      {.name = "pose",
       .help = "pose as the vehicle's odometry has it",
       .make = per_sample<pose_message>(),
       .sets_odometry_rate = true},
      {.name = "camera_pose",
       .help = "the same with optical axes",
       .make = per_sample<camera_pose_message>()},
      {.name = "path",
       .help = "where it flew",
       .make = made_by<FlownPath<path_message>, msg::Path>()},
      {.name = "rotor_speeds", .help = "of the rotors, rpm", .make = per_sample<rotor_speeds>()},
      {.name = "model", .help = "the vehicle's hull", .make = per_sample<model_marker>()},
      {.name = "velocity", .help = "an arrow", .make = per_sample<velocity_marker>()},
      {.name = "trajectory",
       .help = "the flown line",
       .make = made_by<FlownPath<trajectory_marker>, msg::Marker>()},
      {.name = "covariance", .help = "of a pose: none", .make = per_sample<covariance_marker>()},
      {.name = "sensor_model", .help = "the LiDAR", .make = per_sample<sensor_marker>()},
      {.name = "label", .help = "the vehicle's name", .make = per_sample<label_marker>()},
      {.name = "vehicle_cloud",
       .help = "points on the hull of the other vehicle whose odometry came",
       .make = made_by<VehicleCloud, msg::PointCloud2>(),
       .frame = OutputType::Frame::kMap,
       .large = true,
       .depth = 5},
      {.name = "collision_cloud",
       .help = "points of the map that the vehicle's hull touches",
       .make = made_by<TouchedPoints, msg::PointCloud2>(),
       .frame = OutputType::Frame::kMap},
  };
}

}  // namespace pointflight
