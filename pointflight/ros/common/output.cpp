#include "pointflight/ros/common/output.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <map>

#include "pointflight/core/input_error.hpp"
#include "pointflight/ros/common/point_layout.hpp"
#include "pointflight/ros/common/ros_names.hpp"
#include "pointflight/ros/common/scan_messages.hpp"

namespace pointflight {
namespace {

using Per = OutputType::Per;
using Frame = OutputType::Frame;
using Cameras = OutputType::Cameras;

bool names_lidar(const std::string& pattern) {
  return pattern.find("{lidar}") != std::string::npos;
}

/// What the profile calls one of its frames.
std::string pattern_of(const RosRun& ros, Frame frame, bool camera) {
  switch (frame) {
    case Frame::kWorld:
      return ros.profile.world_frame;
    case Frame::kMap:
      return ros.map_frame.is_used() ? ros.map_frame.name : ros.profile.world_frame;
    case Frame::kBody:
    case Frame::kImu:
      return ros.profile.body_frame;
    case Frame::kSensor:
      return ros.profile.sensor_frame;
    case Frame::kOptical:
      return ros.profile.sensor_frame + (camera ? kOpticalSuffix : "");
  }
  return {};
}

/// The profile's own frames are told apart between vehicles and LiDARs, others as they say.
std::string written_out(const RosRun& ros,
                        const std::string& frame,
                        std::size_t vehicle,
                        std::size_t lidar) {
  const std::string& sensor = ros.profile.sensor_frame;
  if (frame == sensor) return ros.sensor_frame(vehicle, lidar);
  if (frame == sensor + kOpticalSuffix) {
    return ros.sensor_frame(vehicle, lidar) + kOpticalSuffix;
  }
  if (frame == ros.profile.body_frame) return ros.body_frame(vehicle);
  return with_names(frame, ros.names(vehicle, lidar));
}

/// The LiDARs of a vehicle that an output has a stream for.
std::vector<std::size_t> lidars_for(const RosOutput& output,
                                    const OutputType& type,
                                    const VehicleDescription& vehicle) {
  const bool each = names_lidar(type.is_transform ? output.child_frame : output.topic);
  const bool wants_camera = type.cameras != Cameras::kExcluded;
  std::vector<std::size_t> all(vehicle.lidars.size());
  for (std::size_t l = 0; l < all.size(); ++l) all[l] = l;
  const auto camera = [&](std::size_t l) { return is_camera(vehicle.lidars[l].settings); };
  if (!each && !all.empty()) {
    const auto first = std::find_if(
        all.begin(), all.end(), [&](std::size_t l) { return camera(l) == wants_camera; });
    all = {first == all.end() ? 0 : *first};
  }
  // a LiDAR has a depth picture only if one is asked for by name
  const bool only_cameras = type.cameras == Cameras::kRequired || (wants_camera && each);
  if (only_cameras) std::erase_if(all, [&](std::size_t l) { return !camera(l); });
  return all;
}

/// Throws if a stream is to say what its points do not know.
void check_marks(const OutputStream& stream) {
  const std::string& layout = stream.settings.layout;
  if (layout.empty() || layout == kLivoxCustom) return;
  if (!point_layout(layout).has(PointLayout::Source::kUnknown)) return;
  const VehicleSetup& setup = stream.ros.run.vehicles[stream.vehicle].setup;
  if (stream.type.per == Per::kLidar && setup.lidars[stream.lidar].mark_unknown) return;
  throw InputError(
      fmt::format("{}: {} is to have the layout {}, which wants a LiDAR with mark_unknown: true",
                  stream.ros.profile.path,
                  stream.settings.topic,
                  layout));
}

}  // namespace

RosNames RosRun::names(std::size_t vehicle, std::size_t lidar) const {
  RosNames names = names_of(profile, run.vehicles[vehicle].setup, vehicle);
  const auto lidars = lidar_names(run.vehicles[vehicle].setup);
  if (lidar < lidars.size()) names.lidar = lidars[lidar];
  return names;
}

std::vector<std::string> lidar_names(const VehicleSetup& vehicle) {
  std::vector<std::string> names;
  std::map<std::string, int> seen;
  for (const LidarMount& mount : vehicle.lidars) {
    const std::string stem = as_ros_word(std::filesystem::path(mount.model).stem().string());
    const int before = seen[stem]++;
    names.push_back(before == 0 ? stem : fmt::format("{}_{}", stem, before));
  }
  return names;
}

std::string RosRun::sensor_frame(std::size_t vehicle, std::size_t lidar) const {
  const RosNames own = names(vehicle, lidar);
  const std::string& pattern = profile.sensor_frame;
  const bool vehicles_apart = vehicle == 0 || names_vehicle(pattern);
  const bool lidars_apart = lidar == 0 || names_lidar(pattern);
  return (vehicles_apart ? "" : own.vehicle + "/") + with_names(pattern, own) +
         (lidars_apart ? "" : "_" + own.lidar);
}

OutputStream::OutputStream(RosRun& run,
                           const OutputType& row,
                           RosOutput entry,
                           std::size_t vehicle_number,
                           std::size_t lidar_number)
    : ros(run),
      type(row),
      settings(std::move(entry)),
      vehicle(vehicle_number),
      lidar(lidar_number),
      schedule_(settings.rate > 0.0 ? settings.rate : 1.0) {
  RosOutput& s = settings;
  const bool camera = type.per == Per::kLidar && is_camera(of_lidar().settings);
  const bool is_far = type.frame == Frame::kMap && ros.map_frame.is_used();
  if (s.frame.empty() || (is_far && s.frame == ros.profile.world_frame)) {
    s.frame = pattern_of(ros, type.frame, camera);
  }
  if (s.child_frame.empty()) s.child_frame = pattern_of(ros, type.child, camera);
  s.frame = written_out(ros, s.frame, vehicle, lidar);
  s.child_frame = s.child_frame == "-" ? "" : written_out(ros, s.child_frame, vehicle, lidar);
  s.topic = absolute(with_names(s.topic, ros.names(vehicle, lidar)));
  if (s.layout.empty()) s.layout = type.layout;
  topic = {s.topic, type.make.type(), type.latched, type.depth, type.large};
  check_marks(*this);
  if (s.layout == kLivoxCustom) {
    topic.type = message_type<msg::CustomMsg>();
    topic.type.package = ros.profile.livox_package;
  }
  output = type.make.make(*this);
}

OutputStream::~OutputStream() = default;

bool OutputStream::is_wanted() const {
  for (std::size_t i = 0; i < ros.outlets.size(); ++i) {
    if (ros.outlets[i]->has_readers(numbers[i])) return true;
  }
  return false;
}

int OutputStream::reader_count() const {
  int count = 0;
  for (std::size_t i = 0; i < ros.outlets.size(); ++i) {
    count += ros.outlets[i]->reader_count(numbers[i]);
  }
  return count;
}

bool OutputStream::has_newcomer(int calls) {
  const int count = reader_count();
  const bool more = count > served_;
  if (more && ++newcomer_calls_ < calls) return false;
  served_ = count;
  newcomer_calls_ = 0;
  return more;
}

bool OutputStream::is_due(SimTime time) {
  if (settings.rate <= 0.0) return is_wanted();
  if (!first_) first_ = time;
  const SimTime since(time - *first_);
  if (schedule_.at(next_) > since) return false;
  while (schedule_.at(next_) <= since) ++next_;
  return is_wanted();
}

std::int64_t OutputStream::stamp_leaving(SimTime leaves) {
  ros.latest = std::max(ros.latest, leaves);
  return (ros.latest.time_since_epoch() + ros.epoch).count();
}

void OutputStream::keep(Bytes (&bytes)[2], std::int64_t time) {
  if (!ros.keeps_scans || type.per != Per::kLidar) return;
  for (int wire = 0; wire < 2; ++wire) last_[wire] = std::move(bytes[wire]);
  last_time_ = time;
  note_served();
}

void OutputStream::resend(int calls) {
  const bool kept = last_[0] || last_[1];
  if (!kept || !has_newcomer(calls)) return;
  for (std::size_t i = 0; i < ros.outlets.size(); ++i) {
    Outlet& outlet = *ros.outlets[i];
    const Bytes& bytes = last_[outlet.wire() == Wire::kRos1 ? 0 : 1];
    if (!bytes || !outlet.is_live()) continue;
    outlet.send(numbers[i], bytes, last_time_);
    outlet.flush();
  }
}

void OutputStream::restart() {
  next_ = 0;
  first_.reset();
  output->on_restart();
}

msg::PointCloud2 points_message(const OutputStream& stream,
                                std::span<const Vector3f> points,
                                SimTime time) {
  msg::PointCloud2 cloud = cloud_of_points(points, {}, point_layout(stream.settings.layout));
  cloud.header = stream.header(time);
  return cloud;
}

std::deque<OutputStream> output_streams(RosRun& ros) {
  std::deque<OutputStream> streams;
  std::map<std::string, std::string> types;  // of each topic
  const auto add = [&](const RosOutput& output,
                       const OutputType& type,
                       std::size_t v,
                       std::size_t l) {
    const Topic& topic = streams.emplace_back(ros, type, output, v, l).topic;
    const std::string name = topic.type.ros1_name();
    const auto [known, is_new] = types.try_emplace(topic.name, name);
    if (is_new || known->second == name) return;
    throw InputError(fmt::format("{}: topic {} would carry both {} and {}; give one another name",
                                 ros.profile.path,
                                 topic.name,
                                 known->second,
                                 name));
  };
  for (const OutputType& type : output_types().rows()) {
    for (const RosOutput& output : ros.profile.outputs) {
      if (output.kind != type.name || !is_used(output.topic)) continue;
      // one name for all can only be one vehicle's, but for transforms, which name their frames
      const bool all = names_vehicle(output.topic) || type.is_transform;
      const std::size_t vehicles = type.per != Per::kRun && all ? ros.run.vehicles.size() : 1;
      for (std::size_t v = 0; v < vehicles; ++v) {
        // another process' part of a shared run; of one name for all, and of the run, the first's
        const bool from_each = type.per == Per::kRun && type.from_each;
        if (!from_each && !ros.run.vehicles[v].own) continue;
        if (type.per != Per::kLidar) {
          add(output, type, v, 0);
          continue;
        }
        for (const std::size_t l : lidars_for(output, type, ros.run.vehicles[v])) {
          add(output, type, v, l);
        }
      }
    }
  }
  return streams;
}

double odometry_rate(const RosProfile& profile) {
  double rate = 0.0;
  for (const RosOutput& output : profile.outputs) {
    const OutputType* type = output_types().find(output.kind);
    if (type != nullptr && type->sets_odometry_rate) rate = std::max(rate, output.rate);
  }
  return rate;
}

double large_rate(const RunDescription& run, const RosProfile& profile) {
  const Executor executor(1);
  double rate = 0.0;
  RosRun ros{.run = run, .profile = profile};
  for (const OutputStream& stream : output_streams(ros)) {
    if (stream.type.per != Per::kLidar || !stream.type.large) continue;
    const RosOutput& s = stream.settings;
    constexpr double kCustomPoint = 20.0;
    constexpr double kPixel = 4.0;
    const bool picture = stream.topic.type.name == "Image";
    const double bytes = picture                    ? kPixel
                         : s.layout == kLivoxCustom ? kCustomPoint
                                                    : point_layout(s.layout).step;
    const Lidar lidar(stream.of_lidar().settings, 0);
    const double scans = lidar.settings().rate;
    rate += (s.rate > 0.0 ? std::min(scans, s.rate) : scans) * bytes *
            static_cast<double>(lidar.beams(0, executor).size());
  }
  return rate;
}

}  // namespace pointflight
