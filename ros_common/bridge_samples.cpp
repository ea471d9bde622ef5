// Messages of samples: RosBridge's half that is a sink.
#include <algorithm>
#include <numeric>

#include "pointflight/core/constants.hpp"
#include "ros_common/bridge.hpp"
#include "ros_common/bridge_stream.hpp"
#include "ros_common/conversion.hpp"
#include "ros_common/display.hpp"
#include "ros_common/point_layout.hpp"
#include "ros_common/scan_messages.hpp"

namespace pointflight {
namespace {

constexpr std::size_t kPathPosesMax = 2000;
constexpr double kSurfaceSpacing = 0.1;  // m between points on obstacles
constexpr std::size_t kScanTimes = 21;   // that MARSIM takes the mean of
constexpr double kRpm = 30.0 / kPi;      // of a rad/s

constexpr msg::ColorRGBA kObstacleColor{0.55f, 0.25f, 0.65f, 0.8f};
constexpr msg::ColorRGBA kCollisionColor{0.85f, 0.1f, 0.1f, 0.9f};

}  // namespace

void RosBridge::send_transform(Stream& stream, const OdometrySample& sample) {
  const auto header = header_of(sample.time, epoch_, stream.settings.frame);
  stream.served = reader_count(stream);
  send(stream,
       msg::TFMessage{
           {transform_of(sample.state.T_world_body(), header, stream.settings.child_frame)}},
       sample.delivered);
}

void RosBridge::on_sample(const Sample& sample) {
  std::visit(Overloaded{[&](const OdometrySample& s) { on_odometry(s); },
                        [&](const ImuSample& s) { on_imu(s); },
                        [&](const ScanSample& s) { on_scan(s); },
                        [&](const CollisionEvent& s) { on_collision(s); },
                        [&](const ObstacleSample& s) { on_obstacle(s); },
                        [](const auto&) {}},
             sample);
}

void RosBridge::on_odometry(const OdometrySample& sample) {
  last_states_[sample.vehicle] = sample;
  for (const auto& s : streams_) {
    Stream& stream = *s;
    const OutputKind kind = stream.type->kind;
    const bool own = stream.vehicle == sample.vehicle;
    if (kind == OutputKind::kVehicleCloud) {
      // the other one's hull, as this one would see it
      if (own || !is_due(stream, sample.delivered)) continue;
      std::vector<Vector3f> points;
      append_surface(simulation_.vehicle(sample.vehicle).shape(),
                     sample.state.T_world_body(),
                     kSurfaceSpacing,
                     points);
      send_cloud(stream, points, sample.time);
      continue;
    }
    if (!own) continue;
    const auto header = header_of(sample.time, epoch_, stream.settings.frame);
    switch (kind) {
      case OutputKind::kOdometry:
        if (!is_due(stream, sample.delivered)) break;
        send(stream,
             odometry_of(
                 sample.state, header, stream.settings.child_frame, profile_.twist == "world"),
             sample.delivered);
        break;
      case OutputKind::kPose:
        if (!is_due(stream, sample.delivered)) break;
        send(stream,
             msg::PoseStamped{header, pose_of(sample.state.T_world_body())},
             sample.delivered);
        break;
      case OutputKind::kCameraPose: {
        if (!is_due(stream, sample.delivered)) break;
        Pose pose = sample.state.T_world_body();
        pose.rotation = optical(pose.rotation);
        send(stream, msg::PoseStamped{header, pose_of(pose)}, sample.delivered);
        break;
      }
      case OutputKind::kTf:
        if (is_due(stream, sample.delivered)) send_transform(stream, sample);
        break;
      case OutputKind::kRotorSpeeds: {
        if (!is_due(stream, sample.delivered)) break;
        msg::Float32MultiArray speeds;
        for (const double w : sample.rotor_commands) {
          speeds.data.push_back(static_cast<float>(w * kRpm));
        }
        send(stream, std::move(speeds), sample.delivered);
        break;
      }
      case OutputKind::kCollisionCloud:
        if (!is_due(stream, sample.delivered)) break;
        send_cloud(stream,
                   touched_points(simulation_.map(),
                                  simulation_.vehicle(sample.vehicle).hull(),
                                  sample.state.T_world_body()),
                   sample.time);
        break;
      case OutputKind::kPath:
        send_path(stream, sample);
        break;
      case OutputKind::kModel:
      case OutputKind::kVelocity:
      case OutputKind::kTrajectory:
      case OutputKind::kCovariance:
      case OutputKind::kSensorModel:
      case OutputKind::kLabel:
        send_markers(stream, sample);
        break;
      default:
        break;
    }
  }
}

/// Notes where the vehicle is; a long path is thinned and stays a small message.
void RosBridge::Stream::add_to_path(const msg::Header& header, const Pose& pose) {
  auto& poses = path.poses;
  path.header = header;
  const bool is_near =
      !poses.empty() &&
      (vector_of(poses.back().pose.position) - pose.translation).norm() < path_spacing;
  if (is_near) return;
  poses.push_back({header, pose_of(pose)});
  if (poses.size() <= kPathPosesMax) return;
  for (std::size_t i = 0; 2 * i < poses.size(); ++i) poses[i] = poses[2 * i];
  poses.resize((poses.size() + 1) / 2);
  path_spacing *= 2.0;
}

void RosBridge::send_path(Stream& stream, const OdometrySample& sample) {
  stream.add_to_path(header_of(sample.time, epoch_, stream.settings.frame),
                     sample.state.T_world_body());
  if (is_due(stream, sample.delivered)) send(stream, stream.path, sample.delivered);
}

void RosBridge::send_markers(Stream& stream, const OdometrySample& sample) {
  const auto header = header_of(sample.time, epoch_, stream.settings.frame);
  if (stream.type->kind == OutputKind::kTrajectory) {
    stream.add_to_path(header, sample.state.T_world_body());
  }
  if (!is_due(stream, sample.delivered)) return;
  send(stream,
       vehicle_marker(stream.type->kind,
                      simulation_.vehicle(sample.vehicle),
                      sample.state,
                      header,
                      stream.type->name,
                      stream.path.poses),
       sample.delivered);
}

void RosBridge::on_imu(const ImuSample& sample) {
  for (const auto& stream : streams_) {
    if (stream->type->kind != OutputKind::kImu || stream->vehicle != sample.vehicle) continue;
    if (!is_due(*stream, sample.time)) continue;
    const ImuSettings& settings = simulation_.vehicle(sample.vehicle).settings().imu;
    const ImuCustoms customs{profile_.imu_unit == "g", profile_.imu_gravity == "down"};
    send(*stream,
         imu_of(sample, settings, header_of(sample.time, epoch_, stream->settings.frame), customs),
         sample.time);
  }
}

void RosBridge::on_scan(const ScanSample& sample) {
  const Scan& scan = *sample.scan;
  for (const auto& stream : streams_) {
    const bool of_lidar = stream->type->per == OutputType::Per::kLidar;
    if (of_lidar && stream->vehicle == scan.vehicle && stream->lidar == scan.sensor &&
        is_due(*stream, scan.end)) {
      send_scan(*stream, sample);
    }
    if (stream->type->kind == OutputKind::kScanTime && stream->vehicle == scan.vehicle &&
        scan_times_.size() >= kScanTimes && is_due(*stream, scan.end)) {
      const double sum = std::accumulate(scan_times_.begin(), scan_times_.end(), 0.0);
      msg::PoseStamped message;
      message.header.stamp = stamp_of(scan.end, epoch_);
      message.pose.position.x = sum / static_cast<double>(scan_times_.size());
      send(*stream, std::move(message), scan.end);
    }
  }
}

void RosBridge::send_scan(Stream& stream, const ScanSample& sample) {
  const Scan& scan = *sample.scan;
  const LidarSettings& lidar =
      simulation_.vehicle(scan.vehicle).lidars()[scan.sensor]->lidar().settings();
  const RosOutput& s = stream.settings;
  const float plain = simulation_.map().has_intensity() ? 0.0f : kPlainIntensity;
  switch (stream.type->kind) {
    case OutputKind::kCloud:
      if (s.layout == "livox_custom") {
        send(stream, custom_cloud_of(scan, s.frame, epoch_, plain), scan.end);
      } else {
        send(stream, cloud_of(scan, point_layout(s.layout), s.frame, epoch_, {}, plain), scan.end);
      }
      break;
    case OutputKind::kCloudWorld: {
      const auto points = world_points(scan, sample.T_world_sensor);
      send(
          stream, cloud_of(scan, point_layout(s.layout), s.frame, epoch_, points, plain), scan.end);
      break;
    }
    case OutputKind::kDepth: {
      msg::Image image = depth_image_of(scan, lidar);
      image.header = header_of(cloud_time(scan, false), epoch_, s.frame);
      send(stream, std::move(image), scan.end);
      break;
    }
    case OutputKind::kCameraInfo: {
      msg::CameraInfo info = camera_info_of(lidar);
      info.header = header_of(cloud_time(scan, false), epoch_, s.frame);
      send(stream, std::move(info), scan.end);
      break;
    }
    case OutputKind::kSensorPose: {
      const SimTime time = cloud_time(scan, false);
      Pose pose = sample.T_world_sensor.at(time);
      pose.rotation = optical(pose.rotation);
      send(stream, msg::PoseStamped{header_of(time, epoch_, s.frame), pose_of(pose)}, scan.end);
      break;
    }
    case OutputKind::kTfScan: {
      const SimTime time = cloud_time(scan, false);
      send(stream,
           msg::TFMessage{{transform_of(
               sample.T_world_sensor.at(time), header_of(time, epoch_, s.frame), s.child_frame)}},
           scan.end);
      break;
    }
    default:
      break;
  }
}

void RosBridge::on_collision(const CollisionEvent& event) {
  if (!event.entered) return;
  for (const auto& stream : streams_) {
    if (stream->type->kind != OutputKind::kCollisions || !is_wanted(*stream)) continue;
    constexpr double kRadius = 0.15;  // m
    send(*stream,
         msg::MarkerArray{{marker_of(Solid{Ball{kRadius}},
                                     {Quaterniond::Identity(), event.place_world},
                                     header_of(event.time, epoch_, stream->settings.frame),
                                     "collisions",
                                     collisions_,
                                     kCollisionColor)}},
         event.time);
  }
  ++collisions_;
}

void RosBridge::on_obstacle(const ObstacleSample& sample) {
  if (!obstacles_.empty() && obstacles_.front().time != sample.time) send_obstacles();
  obstacles_.push_back(sample);
}

/// All obstacles of one instant.
void RosBridge::send_obstacles() {
  const SimTime time = obstacles_.front().time;
  for (const auto& stream : streams_) {
    const OutputKind kind = stream->type->kind;
    if (kind != OutputKind::kObstacles && kind != OutputKind::kMovingCloud) continue;
    if (!is_due(*stream, time)) continue;
    msg::MarkerArray markers;
    std::vector<Vector3f> points;
    for (const ObstacleSample& obstacle : obstacles_) {
      const Pose& pose = obstacle.T_world_body;
      if (kind == OutputKind::kMovingCloud) {
        append_surface(obstacle.shape, pose, kSurfaceSpacing, points);
        continue;
      }
      const auto* solid = std::get_if<Solid>(&obstacle.shape);
      const Solid shown = solid != nullptr ? *solid : Solid{Ball{bounding_radius(obstacle.shape)}};
      markers.markers.push_back(
          marker_of(shown,
                    pose,
                    header_of(time, epoch_, stream->settings.frame),
                    "obstacles",
                    static_cast<std::int32_t>(obstacle.label - kFirstObstacle),
                    kObstacleColor));
    }
    if (kind == OutputKind::kMovingCloud) {
      send_cloud(*stream, points, time);
    } else {
      send(*stream, std::move(markers), time);
    }
  }
  obstacles_.clear();
}

void RosBridge::note_scan_time(double seconds) {
  scan_times_.push_back(seconds);
  if (scan_times_.size() > kScanTimes) scan_times_.erase(scan_times_.begin());
}

}  // namespace pointflight
