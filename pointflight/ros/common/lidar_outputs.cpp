// Messages about each scan of a LiDAR: clouds, pictures, the sensor's poses.
#include <fmt/format.h>

#include <optional>

#include "pointflight/core/input_error.hpp"
#include "pointflight/ros/common/output_rows.hpp"
#include "pointflight/ros/common/point_layout.hpp"
#include "pointflight/ros/common/scan_messages.hpp"

namespace pointflight {
namespace {

using Frame = OutputType::Frame;
using Cameras = OutputType::Cameras;

/// Of returns that have no intensity.
float plain_intensity(const OutputStream& stream) {
  return stream.ros.run.map->has_intensity() ? 0.0f : kPlainIntensity;
}

/// The cells of a stream's clouds; nothing if they are not organised. Throws InputError if its
/// layout cannot be.
std::optional<CloudGrid> grid_of(const OutputStream& stream) {
  const RosOutput& s = stream.settings;
  if (s.layout == kLivoxCustom && stream.type.frame != Frame::kSensor) {
    throw InputError(
        fmt::format("{}: {}: Livox' own message is of the sensor's frame; give it "
                    "another layout",
                    stream.ros.profile.path,
                    s.topic));
  }
  if (!s.organized) return std::nullopt;
  if (s.layout != kLivoxCustom) return CloudGrid(stream.of_lidar().settings);
  throw InputError(
      fmt::format("{}: {}: Livox' own message has no rows; give organized: true another layout",
                  stream.ros.profile.path,
                  s.topic));
}

/// In the sensor's frame or the world, in one of the layouts or Livox' own message.
template <bool in_world>
class Cloud : public Output {
 public:
  explicit Cloud(OutputStream& stream) : Output(stream), grid_(grid_of(stream)) {}
  void on_sample(const Sample& sample) override {
    const auto* scanned = std::get_if<ScanSample>(&sample);
    if (scanned == nullptr || !stream_.is_about(*scanned)) return;
    const Scan& scan = *scanned->scan;
    if (!stream_.is_due(scan.end)) return;
    const RosOutput& s = stream_.settings;
    const Duration epoch = stream_.ros.epoch;
    const float plain = plain_intensity(stream_);
    if (s.layout == kLivoxCustom) {
      stream_.send(custom_cloud_of(scan, s.frame, epoch, plain), scan.end);
      return;
    }
    std::vector<Vector3f> positions;
    if (in_world) positions = world_points(scan, scanned->T_world_sensor, stream_.frame_origin());
    const CloudGrid* grid = grid_ ? &*grid_ : nullptr;
    stream_.send(cloud_of(scan, point_layout(s.layout), s.frame, epoch, positions, plain, grid),
                 scan.end);
  }

 private:
  std::optional<CloudGrid> grid_;
};

msg::Image depth_image(const OutputStream& stream, const ScanSample& sample) {
  msg::Image image = depth_image_of(*sample.scan, stream.of_lidar().settings);
  image.header = stream.header(cloud_time(*sample.scan, false));
  return image;
}

/// Where a scan has one.
class Infrared : public Output {
 public:
  using Output::Output;
  void on_sample(const Sample& sample) override {
    const auto* scanned = std::get_if<ScanSample>(&sample);
    if (scanned == nullptr || !stream_.is_about(*scanned)) return;
    const Scan& scan = *scanned->scan;
    if (scan.infrared.empty() || !stream_.is_due(scan.end)) return;
    msg::Image image = infrared_image_of(scan, stream_.of_lidar().settings);
    image.header = stream_.header(cloud_time(scan, false));
    stream_.send(image, scan.end);
  }
};

msg::CameraInfo camera_info(const OutputStream& stream, const ScanSample& sample) {
  msg::CameraInfo info = camera_info_of(stream.of_lidar().settings);
  info.header = stream.header(cloud_time(*sample.scan, false));
  return info;
}

msg::PoseStamped sensor_pose(const OutputStream& stream, const ScanSample& sample) {
  const SimTime time = cloud_time(*sample.scan, false);
  Pose pose = sample.T_world_sensor.at(time);
  pose.rotation = optical(pose.rotation);
  return {stream.header(time), pose_of(pose)};
}

msg::TFMessage sensor_transform(const OutputStream& stream, const ScanSample& sample) {
  const SimTime time = cloud_time(*sample.scan, false);
  return {{transform_of(
      sample.T_world_sensor.at(time), stream.header(time), stream.settings.child_frame)}};
}

}  // namespace

std::vector<OutputType> lidar_outputs() {
  constexpr auto kLidar = OutputType::Per::kLidar;
  return {
      {.name = "tf_scan",
       .help = "the sensor in the world, with each scan",
       .make = per_sample<sensor_transform>(),
       .per = kLidar,
       .child = Frame::kSensor,
       .has_child = true,
       .is_transform = true,
       .depth = 100},
      {.name = "sensor_pose",
       .help = "the sensor's pose with each scan, optical axes",
       .make = per_sample<sensor_pose>(),
       .per = kLidar},
      {.name = "cloud",
       .help = "a scan in the sensor's frame",
       .make = made_by<Cloud<false>, msg::PointCloud2>(),
       .per = kLidar,
       .frame = Frame::kSensor,
       .large = true,
       .depth = 5,
       .layout = "xyzit"},
      {.name = "cloud_world",
       .help = "a scan in the world",
       .make = made_by<Cloud<true>, msg::PointCloud2>(),
       .per = kLidar,
       .frame = Frame::kMap,
       .large = true,
       .depth = 5},
      {.name = "depth",
       .help = "depth picture, 32FC1",
       .make = per_sample<depth_image>(),
       .per = kLidar,
       .frame = Frame::kOptical,
       .cameras = Cameras::kPreferred,
       .large = true,
       .depth = 5},
      {.name = "infrared",
       .help = "infrared picture of a depth camera, mono8",
       .make = made_by<Infrared, msg::Image>(),
       .per = kLidar,
       .frame = Frame::kOptical,
       .cameras = Cameras::kRequired,
       .large = true,
       .depth = 5},
      {.name = "camera_info",
       .help = "camera matrix of a depth camera",
       .make = per_sample<camera_info>(),
       .per = kLidar,
       .frame = Frame::kOptical,
       .cameras = Cameras::kRequired},
  };
}

}  // namespace pointflight
