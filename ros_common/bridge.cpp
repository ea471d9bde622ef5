#include "ros_common/bridge.hpp"

#include <algorithm>

#include "pointflight/core/constants.hpp"
#include "pointflight/geometry/rotation.hpp"
#include "ros_common/bridge_stream.hpp"
#include "ros_common/conversion.hpp"
#include "ros_common/display.hpp"
#include "ros_common/point_layout.hpp"
#include "ros_common/scan_messages.hpp"

namespace pointflight {
namespace {

constexpr std::size_t kMapPointsMax = 1'000'000;
constexpr Duration kLatchedPeriod = std::chrono::milliseconds(50);

Pose imu_mount(const ImuSettings& imu) {
  const Vector3d rpy = imu.rotation_rpy_deg * kDegree;
  return {quaternion_from_rpy(rpy.x(), rpy.y(), rpy.z()), imu.position};
}

}  // namespace

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
      const MountedLidar& mounted = *agent.lidars()[l];
      const std::string frame = sensor_frame_of(profile_, names, v, l);
      message.transforms.push_back(transform_of(mounted.T_body_sensor(), header, frame));
      if (!is_camera(mounted.lidar().settings())) continue;
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

}  // namespace pointflight
