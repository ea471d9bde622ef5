// Messages about the whole run: clock, map, static transforms, obstacles, collisions, diagnostics.
#include <fmt/format.h>

#include <future>
#include <map>
#include <numeric>
#include <set>

#include "pointflight/core/constants.hpp"
#include "pointflight/geometry/rotation.hpp"
#include "pointflight/ros/common/output_rows.hpp"
#include "pointflight/ros/common/point_layout.hpp"
#include "pointflight/ros/common/scan_messages.hpp"

namespace pointflight {
namespace {

using Per = OutputType::Per;

constexpr std::size_t kMapPointsMax = 1'000'000;
constexpr double kObstacleSpacing = 0.1;   // m between points on obstacles
constexpr double kCollisionRadius = 0.15;  // m
constexpr msg::ColorRGBA kObstacleColor{0.55f, 0.25f, 0.65f, 0.8f};
constexpr msg::ColorRGBA kCollisionColor{0.85f, 0.1f, 0.1f, 0.9f};

class ClockOutput : public Output {
 public:
  using Output::Output;
  void on_time(SimTime time) override {
    if (stream_.is_due(time)) send(time);
  }
  void on_wait(SimTime now) override {
    if (stream_.is_wanted()) send(now);
  }

 private:
  void send(SimTime time) { stream_.send(msg::Clock{stamp_of(time, stream_.ros.epoch)}, time); }
};

/// Sent once, when the first reader is there; others get it from the transport.
class MapOutput : public Output {
 public:
  using Output::Output;
  void on_start() override {
    if (stream_.is_wanted()) stream_.send(message(stream_.header(SimTime{})), SimTime{});
  }
  void on_look() override {
    if (stream_.sent() > 0) return;
    if (made_.valid()) {
      if (made_.wait_for(std::chrono::seconds(0)) != std::future_status::ready) return;
      stream_.send(made_.get(), stream_.ros.latest);
    } else if (stream_.is_wanted()) {
      // half a second of work for a large map: beside the flight
      made_ = std::async(std::launch::async,
                         [this, header = stream_.header(SimTime{})] { return message(header); });
    }
  }

 private:
  [[nodiscard]] msg::PointCloud2 message(const msg::Header& header) const {
    const RosOutput& s = stream_.settings;
    const MapCloud map =
        map_cloud(*stream_.ros.run.map, s.resolution, kMapPointsMax, stream_.frame_origin());
    msg::PointCloud2 cloud = cloud_of_points(map.points, map.intensities, point_layout(s.layout));
    cloud.header = header;
    return cloud;
  }
  std::future<msg::PointCloud2> made_;  ///< For a reader that came late.
};

/// Where sensors sit on their vehicles, and where the map's frame is; small, and asked for before
/// anything else: there before the first who asks.
class StaticTransforms : public Output {
 public:
  using Output::Output;
  void on_start() override { send(); }
  void on_look() override {
    if (stream_.has_newcomer(1)) send();
  }

 private:
  void send() {
    stream_.note_served();
    msg::TFMessage message;
    for (std::size_t v = 0; v < stream_.ros.run.vehicles.size(); ++v) {
      if (stream_.ros.run.vehicles[v].own) add_lidars(v, message);
    }
    for (const OutputStream& other : *stream_.ros.streams) add_own_frame(other, message);
    add_map_frames(message);
    stream_.send(std::move(message), SimTime{}, true);
  }
  void add(const Pose& pose,
           const std::string& parent,
           const std::string& child,
           msg::TFMessage& message) const {
    const msg::Header header = header_of(SimTime{}, stream_.ros.epoch, parent);
    message.transforms.push_back(transform_of(pose, header, child));
  }
  void add_lidars(std::size_t v, msg::TFMessage& message) const {
    const RosRun& ros = stream_.ros;
    const auto& lidars = ros.run.vehicles[v].lidars;
    for (std::size_t l = 0; l < lidars.size(); ++l) {
      const std::string frame = ros.sensor_frame(v, l);
      add(lidars[l].T_body_sensor, ros.body_frame(v), frame, message);
      if (!is_camera(lidars[l].settings)) continue;
      const Pose turned{optical(Quaterniond::Identity()), Vector3d::Zero()};
      add(turned, frame, frame + kOpticalSuffix, message);
    }
  }
  /// Of clouds of a map far from zero; a profile may call them otherwise.
  void add_map_frames(msg::TFMessage& message) const {
    const RosRun& ros = stream_.ros;
    if (!ros.map_frame.is_used()) return;
    std::set<std::string> names{ros.map_frame.name};
    for (const OutputStream& other : *ros.streams) {
      if (other.type.frame == OutputType::Frame::kMap) names.insert(other.settings.frame);
    }
    const Pose origin{Quaterniond::Identity(), ros.map_frame.origin};
    for (const std::string& name : names) add(origin, ros.profile.world_frame, name, message);
  }
  /// An IMU with a frame of its own.
  void add_own_frame(const OutputStream& other, msg::TFMessage& message) const {
    if (other.type.frame != OutputType::Frame::kImu) return;
    const std::string body = stream_.ros.body_frame(other.vehicle);
    if (other.settings.frame == body) return;
    const ImuSettings& imu = other.of_vehicle().settings.imu;
    const Vector3d rpy = imu.rotation_rpy_deg * kDegree;
    const Pose mount{quaternion_from_rpy(rpy.x(), rpy.y(), rpy.z()), imu.position};
    add(mount, body, other.settings.frame, message);
  }
};

/// What each vehicle does, what it met, what was refused.
class Diagnostics : public Output {
 public:
  using Output::Output;
  void on_time(SimTime time) override {
    if (!stream_.is_due(time)) return;
    msg::DiagnosticArray message;
    message.header = header_of(time, stream_.ros.epoch, "");
    for (const StatusSample& status : stream_.ros.status) {
      if (stream_.ros.run.vehicles[status.vehicle].own) message.status.push_back(of(status));
    }
    stream_.send(std::move(message), time);
  }

 private:
  [[nodiscard]] msg::DiagnosticStatus of(const StatusSample& s) const {
    const VehicleSetup& setup = stream_.ros.run.vehicles[s.vehicle].setup;
    msg::DiagnosticStatus status;
    status.name = "pointflight: " + setup.name;
    status.hardware_id = setup.model;
    constexpr auto kWarn = msg::Octet{1};
    constexpr auto kError = msg::Octet{2};
    if (s.crashed) {
      status.level = kError;
      status.message = "crashed";
    } else if (s.touches) {
      status.level = kWarn;
      status.message = "in contact";
    } else {
      status.message = s.landed ? "on the ground" : s.command;
    }
    status.values = {{"time", fmt::format("{:.3f}", to_seconds(s.time))},
                     {"command", s.command},
                     {"armed", s.armed ? "true" : "false"},
                     {"clearance", s.clearance ? fmt::format("{:.2f}", *s.clearance) : ""},
                     {"collisions", fmt::format("{}", s.collisions)},
                     {"commands_rejected", fmt::format("{}", s.rejected)},
                     {"last_rejection", s.last_rejection},
                     {"messages_refused", fmt::format("{}", stream_.ros.refused)},
                     {"last_message_refused", stream_.ros.last_refused},
                     {"command_timeouts", fmt::format("{}", s.timeouts)},
                     {"scans", fmt::format("{}", s.scans)}};
    return status;
  }
};

msg::MarkerArray obstacle_markers(const OutputStream& stream, const ObstacleSample& sample) {
  msg::MarkerArray markers;
  for (const auto& [label, pose, shape] : sample.obstacles) {
    const auto* solid = std::get_if<Solid>(&shape);
    markers.markers.push_back(
        marker_of(solid != nullptr ? *solid : Solid{Sphere{bounding_radius(shape)}},
                  pose,
                  stream.header(sample.time),
                  "obstacles",
                  static_cast<std::int32_t>(label - kFirstObstacle),
                  kObstacleColor));
  }
  return markers;
}

msg::PointCloud2 obstacle_points(const OutputStream& stream, const ObstacleSample& sample) {
  std::vector<Vector3f> points;
  for (const auto& [label, pose, shape] : sample.obstacles) {
    append_surface(shape, stream.in_frame(pose), kObstacleSpacing, points);
  }
  return points_message(stream, points, sample.time);
}

/// Viewers tell markers apart by namespace and number: each vehicle has its own, whoever flies it.
class CollisionMarkers : public Output {
 public:
  using Output::Output;
  void on_sample(const Sample& sample) override {
    const auto* event = std::get_if<CollisionEvent>(&sample);
    if (event == nullptr || !event->entered) return;
    const std::int32_t number = counts_[event->vehicle]++;
    if (stream_.is_wanted()) {
      const bool is_one = stream_.ros.run.vehicles.size() == 1;
      const std::string name = stream_.ros.names(event->vehicle).vehicle;
      stream_.send(msg::MarkerArray{{marker_of(Solid{Sphere{kCollisionRadius}},
                                               {Quaterniond::Identity(), event->position_world},
                                               stream_.header(event->time),
                                               is_one ? "collisions" : "collisions/" + name,
                                               number,
                                               kCollisionColor)}},
                   event->time);
    }
  }

 private:
  std::map<std::uint32_t, std::int32_t> counts_;  ///< By vehicle.
};

/// In position.x the mean seconds that the last scans took.
class ScanTime : public Output {
 public:
  using Output::Output;
  void on_sample(const Sample& sample) override {
    const auto* scan = std::get_if<ScanSample>(&sample);
    const std::vector<double>& times = stream_.ros.scan_times;
    if (scan == nullptr || !stream_.is_about(*scan) || times.size() < kScanTimes) return;
    const SimTime end = scan->scan->end;
    if (!stream_.is_due(end)) return;
    msg::PoseStamped message;
    message.header.stamp = stamp_of(end, stream_.ros.epoch);
    message.pose.position.x =
        std::accumulate(times.begin(), times.end(), 0.0) / static_cast<double>(times.size());
    stream_.send(std::move(message), end);
  }
};

}  // namespace

std::vector<OutputType> leading_outputs() {
  return {
      {.name = "clock",
       .help = "simulated time",
       .make = made_by<ClockOutput, msg::Clock>(),
       .per = Per::kRun,
       .depth = 1},
      {.name = "map",
       .help = "the map's points, latched",
       .make = made_by<MapOutput, msg::PointCloud2>(),
       .per = Per::kRun,
       .frame = OutputType::Frame::kMap,
       .latched = true,
       .large = true,
       .depth = 1},
      {.name = "tf_static",
       .help = "sensors on their vehicles, the frame of a map far from zero, latched",
       .make = made_by<StaticTransforms, msg::TFMessage>(),
       .per = Per::kRun,
       .from_each = true,
       .latched = true,
       .depth = 1},
  };
}

std::vector<OutputType> trailing_outputs() {
  return {
      {.name = "moving_cloud",
       .help = "points on the surfaces of obstacles",
       .make = per_sample<obstacle_points>(),
       .frame = OutputType::Frame::kMap,
       .large = true,
       .depth = 5},
      {.name = "obstacles",
       .help = "obstacles as shapes",
       .make = per_sample<obstacle_markers>(),
       .per = Per::kRun},
      {.name = "collisions",
       .help = "where vehicles hit something",
       .make = made_by<CollisionMarkers, msg::MarkerArray>(),
       .per = Per::kRun,
       .from_each = true},
      {.name = "scan_time",
       .help = "position.x: mean seconds that the last 21 scans took",
       .make = made_by<ScanTime, msg::PoseStamped>()},
      {.name = "diagnostics",
       .help = "each vehicle's state in words, once a second",
       .make = made_by<Diagnostics, msg::DiagnosticArray>(),
       .per = Per::kRun,
       .from_each = true},
  };
}

}  // namespace pointflight
