#include "ros_common/bridge.hpp"

#include <algorithm>
#include <numeric>

#include "pointflight/core/constants.hpp"
#include "pointflight/geometry/rotation.hpp"
#include "ros_common/conversion.hpp"
#include "ros_common/display.hpp"
#include "ros_common/point_layout.hpp"
#include "ros_common/scan_messages.hpp"

namespace pointflight {
namespace {

constexpr std::size_t kMapPointsMax = 1'000'000;
constexpr std::size_t kPathPosesMax = 2000;
constexpr Duration kLatchedPeriod = std::chrono::milliseconds(50);
constexpr double kPathSpacing = 0.1;     // m between poses of a path
constexpr double kSurfaceSpacing = 0.1;  // m between points on obstacles
constexpr std::size_t kScanTimes = 21;   // that MARSIM takes the mean of
constexpr double kRpm = 30.0 / kPi;      // of a rad/s

constexpr msg::ColorRGBA kObstacleColor{0.55f, 0.25f, 0.65f, 0.8f};
constexpr msg::ColorRGBA kCollisionColor{0.85f, 0.1f, 0.1f, 0.9f};

Pose imu_mount(const ImuSettings& imu) {
  const Vector3d rpy = imu.rotation_rpy_deg * kDegree;
  return {quaternion_from_rpy(rpy.x(), rpy.y(), rpy.z()), imu.position};
}

}  // namespace

struct RosBridge::Stream : OutputStream {
  explicit Stream(OutputStream stream)
      : OutputStream(std::move(stream)), schedule(settings.rate > 0.0 ? settings.rate : 1.0) {}

  Schedule schedule;
  std::optional<SimTime> first;  ///< Sample: the schedule counts from it.
  std::int64_t next = 0;         ///< Of the schedule.
  std::vector<int> numbers;      ///< At each outlet.
  std::uint32_t sent = 0;
  int served = 0;              ///< Readers that have got what there is.
  int newcomer_calls = 0;      ///< Since there are more of them.
  Bytes last_ros1, last_cdr;   ///< Of a scan, where it may have to be sent again.
  std::int64_t last_time = 0;  ///< When it left.
  msg::Path path;              ///< Of paths and trajectories.
  void add_to_path(const msg::Header& header, const Pose& pose);
  double path_spacing = kPathSpacing;
};

RosBridge::RosBridge(const Simulation& simulation, const RosProfile& profile, Duration epoch)
    : simulation_(simulation),
      profile_(profile),
      epoch_(epoch),
      last_states_(simulation.vehicle_count()),
      next_latched_(SimTime{} + kLatchedPeriod) {
  for (OutputStream& stream : output_streams(simulation, profile)) {
    streams_.push_back(std::make_unique<Stream>(std::move(stream)));
  }
}

RosBridge::~RosBridge() = default;

double RosBridge::odometry_rate(const RosProfile& profile) {
  double rate = 0.0;
  for (const RosOutput& output : profile.outputs) {
    if (output.kind == "odometry" || output.kind == "tf" || output.kind == "pose") {
      rate = std::max(rate, output.rate);
    }
  }
  return rate;
}

void RosBridge::add(Outlet& outlet) {
  outlets_.push_back(&outlet);
  std::map<std::string, int> known;  // several streams may share a topic
  for (const auto& stream : streams_) {
    const auto [at, is_new] = known.try_emplace(stream->topic.name, 0);
    if (is_new) at->second = outlet.advertise(stream->topic);
    stream->numbers.push_back(at->second);
  }
}

bool RosBridge::has_scan_readers() const {
  return std::any_of(streams_.begin(), streams_.end(), [&](const auto& stream) {
    const OutputKind kind = stream->type->kind;
    const bool scan =
        kind == OutputKind::kCloud || kind == OutputKind::kCloudWorld || kind == OutputKind::kDepth;
    return scan && is_wanted(*stream);
  });
}

bool RosBridge::is_wanted(const Stream& stream) const {
  for (std::size_t i = 0; i < outlets_.size(); ++i) {
    if (outlets_[i]->has_readers(stream.numbers[i])) return true;
  }
  return false;
}

int RosBridge::reader_count(const Stream& stream) const {
  int count = 0;
  for (std::size_t i = 0; i < outlets_.size(); ++i) {
    count += outlets_[i]->reader_count(stream.numbers[i]);
  }
  return count;
}

bool RosBridge::has_newcomer(Stream& stream, int calls) const {
  const int count = reader_count(stream);
  if (count <= stream.served) {
    stream.served = count;
    stream.newcomer_calls = 0;
    return false;
  }
  if (++stream.newcomer_calls < calls) return false;
  stream.served = count;
  stream.newcomer_calls = 0;
  return true;
}

bool RosBridge::is_due(Stream& stream, SimTime time) const {
  if (stream.settings.rate <= 0.0) return is_wanted(stream);
  if (!stream.first) stream.first = time;
  const SimTime since(time - *stream.first);
  if (stream.schedule.at(stream.next) > since) return false;
  while (stream.schedule.at(stream.next) <= since) ++stream.next;
  return is_wanted(stream);
}

template <class M>
void RosBridge::send(Stream& stream, M message, SimTime leaves) {
  if constexpr (requires { message.header; }) message.header.seq = stream.sent;
  ++stream.sent;
  latest_ = std::max(latest_, leaves);  // outlets see time go one way
  const std::int64_t time = (latest_.time_since_epoch() + epoch_).count();
  Bytes ros1;
  Bytes cdr;
  // transports keep the latter for whoever comes
  const bool always = stream.type->kind == OutputKind::kTfStatic;
  for (std::size_t i = 0; i < outlets_.size(); ++i) {
    if (!always && !outlets_[i]->has_readers(stream.numbers[i])) continue;
    Bytes& bytes = outlets_[i]->wire() == Wire::kRos1 ? ros1 : cdr;
    if (!bytes) {
      bytes = std::make_shared<const std::vector<std::byte>>(outlets_[i]->wire() == Wire::kRos1
                                                                 ? encode<Wire::kRos1>(message)
                                                                 : encode<Wire::kCdr>(message));
    }
    outlets_[i]->send(stream.numbers[i], bytes, time);
  }
  if (keeps_scans_ && stream.type->per == OutputType::Per::kLidar) {
    stream.last_ros1 = ros1;
    stream.last_cdr = cdr;
    stream.last_time = time;
    stream.served = reader_count(stream);
  }
}

void RosBridge::start() {
  for (Outlet* outlet : outlets_) outlet->start();
  on_time(SimTime{});  // the clock before anything with a stamp
  for (const auto& stream : streams_) {
    if (stream->type->kind == OutputKind::kMap && is_wanted(*stream)) {
      send(*stream, map_message(*stream, epoch_), SimTime{});
    }
    // small, and asked for before anything else: there before the first who asks
    if (stream->type->kind == OutputKind::kTfStatic) send_static_transforms(*stream);
  }
  for (Outlet* outlet : outlets_) outlet->flush();
}

/// What is sent once, when the first reader is there; others get it from the transport.
void RosBridge::send_latched() {
  for (const auto& stream : streams_) {
    if (stream->type->kind == OutputKind::kTfStatic && has_newcomer(*stream, 1)) {
      send_static_transforms(*stream);
    }
    if (stream->type->kind != OutputKind::kMap || stream->sent > 0) continue;
    if (map_.valid()) {
      if (map_.wait_for(std::chrono::seconds(0)) != std::future_status::ready) continue;
      send(*stream, map_.get(), latest_);
    } else if (is_wanted(*stream)) {
      // half a second of work for a large map: beside the flight
      map_ = std::async(std::launch::async,
                        [this, &s = *stream, epoch = epoch_] { return map_message(s, epoch); });
    }
  }
}

void RosBridge::shift_epoch(Duration by) {
  epoch_ += by;
  latest_ = SimTime{};
  next_latched_ = SimTime{} + kLatchedPeriod;
  last_states_.assign(last_states_.size(), std::nullopt);
  for (const auto& stream : streams_) {
    stream->next = 0;
    stream->first.reset();
    stream->path = {};
  }
}

void RosBridge::send_cloud(Stream& stream, const std::vector<Vector3f>& points, SimTime time) {
  msg::PointCloud2 cloud = cloud_of_points(points, {}, point_layout(stream.settings.layout));
  cloud.header = header_of(time, epoch_, stream.settings.frame);
  send(stream, std::move(cloud), time);
}

msg::PointCloud2 RosBridge::map_message(const Stream& stream, Duration epoch) const {
  const MapCloud map = map_cloud(simulation_.map(), stream.settings.resolution, kMapPointsMax);
  msg::PointCloud2 cloud =
      cloud_of_points(map.points, map.intensities, point_layout(stream.settings.layout));
  cloud.header = header_of(SimTime{}, epoch, stream.settings.frame);
  return cloud;
}

void RosBridge::send_static_transforms(Stream& stream) {
  stream.served = reader_count(stream);
  msg::TFMessage message;
  for (std::size_t v = 0; v < simulation_.vehicle_count(); ++v) {
    const VehicleAgent& agent = simulation_.vehicle(v);
    RosNames names{agent.setup().name, profile_.first_id + static_cast<std::int64_t>(v), ""};
    const msg::Header header = header_of(SimTime{}, epoch_, body_frame_of(profile_, names, v));
    const auto lidars = lidar_names(agent);
    for (std::size_t l = 0; l < lidars.size(); ++l) {
      names.lidar = lidars[l];
      const MountedLidar& mounted = agent.lidars()[l];
      const std::string frame = sensor_frame_of(profile_, names, v, l);
      message.transforms.push_back(transform_of(mounted.T_body_sensor, header, frame));
      if (!is_camera(mounted.lidar->settings())) continue;
      msg::Header sensor = header;
      sensor.frame_id = frame;
      const Pose turned{optical(Quaterniond::Identity()), Vector3d::Zero()};
      message.transforms.push_back(transform_of(turned, sensor, frame + kOpticalSuffix));
    }
  }
  // an IMU with a frame of its own
  for (const auto& other : streams_) {
    if (other->type->kind != OutputKind::kImu) continue;
    const VehicleAgent& agent = simulation_.vehicle(other->vehicle);
    const RosNames names{
        agent.setup().name, profile_.first_id + static_cast<std::int64_t>(other->vehicle), ""};
    const std::string body = body_frame_of(profile_, names, other->vehicle);
    if (other->settings.frame == body) continue;
    message.transforms.push_back(transform_of(imu_mount(agent.settings().imu),
                                              header_of(SimTime{}, epoch_, body),
                                              other->settings.frame));
  }
  send(stream, std::move(message), SimTime{});
}

void RosBridge::on_time(SimTime time) {
  if (!obstacles_.empty()) send_obstacles();
  for (const auto& stream : streams_) {
    const OutputKind kind = stream->type->kind;
    if (kind == OutputKind::kClock && is_due(*stream, time)) {
      send(*stream, msg::Clock{stamp_of(time, epoch_)}, time);
    }
    if (kind == OutputKind::kDiagnostics && is_due(*stream, time)) {
      send(*stream,
           diagnostics_of(simulation_, time, header_of(time, epoch_, ""), refused_, last_refused_),
           time);
    }
  }
  if (time >= next_latched_) {
    next_latched_ = time + kLatchedPeriod;
    send_latched();
  }
  for (Outlet* outlet : outlets_) outlet->flush();
}

void RosBridge::repeat() {
  // where it stands, which is seldom where the clock's rate put its last message
  const SimTime now = std::max(latest_, simulation_.time());
  for (const auto& stream : streams_) {
    const OutputKind kind = stream->type->kind;
    if (kind == OutputKind::kClock && is_wanted(*stream)) {
      send(*stream, msg::Clock{stamp_of(now, epoch_)}, now);
    }
    constexpr int kCalls = 10;
    if (kind == OutputKind::kTf && has_newcomer(*stream, kCalls)) {
      send_transform(*stream, last_state_of(stream->vehicle));
    }
  }
  send_latched();
  for (Outlet* outlet : outlets_) outlet->flush();
}

void RosBridge::resend_scans() {
  constexpr int kCalls = 2000;
  for (const auto& stream : streams_) {
    const bool kept = stream->last_ros1 || stream->last_cdr;
    if (!kept || !has_newcomer(*stream, kCalls)) continue;
    for (std::size_t i = 0; i < outlets_.size(); ++i) {
      const Bytes& bytes =
          outlets_[i]->wire() == Wire::kRos1 ? stream->last_ros1 : stream->last_cdr;
      if (bytes && outlets_[i]->is_live()) {
        outlets_[i]->send(stream->numbers[i], bytes, stream->last_time);
        outlets_[i]->flush();
      }
    }
  }
}

/// Of odometry; before the first of it, where the vehicle starts.
OdometrySample RosBridge::last_state_of(std::size_t vehicle) const {
  if (last_states_[vehicle]) return *last_states_[vehicle];
  OdometrySample sample;
  sample.vehicle = static_cast<std::uint32_t>(vehicle);
  sample.state = simulation_.status(vehicle).state.body;
  return sample;
}

void RosBridge::note_refused(std::uint64_t count, const std::string& last) {
  refused_ = count;
  last_refused_ = last;
}

void RosBridge::send_transform(Stream& stream, const OdometrySample& sample) {
  const auto header = header_of(sample.time, epoch_, stream.settings.frame);
  stream.served = reader_count(stream);
  send(stream,
       msg::TFMessage{
           {transform_of(sample.state.T_world_body(), header, stream.settings.child_frame)}},
       sample.delivered);
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
        for (const double w : simulation_.status(sample.vehicle).rotor_commands) {
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

void RosBridge::on_imu(std::uint32_t vehicle, const ImuSample& sample) {
  for (const auto& stream : streams_) {
    if (stream->type->kind != OutputKind::kImu || stream->vehicle != vehicle) continue;
    if (!is_due(*stream, sample.time)) continue;
    const ImuSettings& settings = simulation_.vehicle(vehicle).settings().imu;
    const ImuCustoms customs{profile_.imu_unit == "g", profile_.imu_gravity == "down"};
    send(*stream,
         imu_of(sample, settings, header_of(sample.time, epoch_, stream->settings.frame), customs),
         sample.time);
  }
}

void RosBridge::on_scan(const Scan& scan, const PoseAt& pose_at) {
  for (const auto& stream : streams_) {
    const bool of_lidar = stream->type->per == OutputType::Per::kLidar;
    if (of_lidar && stream->vehicle == scan.vehicle && stream->lidar == scan.sensor &&
        is_due(*stream, scan.end)) {
      send_scan(*stream, scan, pose_at);
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

void RosBridge::send_scan(Stream& stream, const Scan& scan, const PoseAt& pose_at) {
  const LidarSettings& lidar =
      simulation_.vehicle(scan.vehicle).lidars()[scan.sensor].lidar->settings();
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
      const auto points = world_points(scan, pose_at);
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
      Pose pose = pose_at(time);
      pose.rotation = optical(pose.rotation);
      send(stream, msg::PoseStamped{header_of(time, epoch_, s.frame), pose_of(pose)}, scan.end);
      break;
    }
    case OutputKind::kTfScan: {
      const SimTime time = cloud_time(scan, false);
      send(stream,
           msg::TFMessage{
               {transform_of(pose_at(time), header_of(time, epoch_, s.frame), s.child_frame)}},
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
    for (const Body& body : simulation_.obstacles(time, time)) {
      if (time < body.from || time >= body.until) continue;
      const Pose pose = body.T_world_body(time);
      if (kind == OutputKind::kMovingCloud) {
        append_surface(body.shape, pose, kSurfaceSpacing, points);
        continue;
      }
      const auto* solid = std::get_if<Solid>(&body.shape);
      const Solid shown = solid != nullptr ? *solid : Solid{Ball{bounding_radius(body.shape)}};
      markers.markers.push_back(marker_of(shown,
                                          pose,
                                          header_of(time, epoch_, stream->settings.frame),
                                          "obstacles",
                                          static_cast<std::int32_t>(body.label - kFirstObstacle),
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
