#include "pointflight/recording/recorded_survey.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <utility>

#include "pointflight/core/input_error.hpp"
#include "pointflight/io/byte_cursor.hpp"
#include "pointflight/ros/common/cloud_points.hpp"
#include "pointflight/ros/common/codec.hpp"
#include "pointflight/ros/common/conversion.hpp"

namespace pointflight {
namespace {

constexpr double kClocksApart = 1.0;    // s between a cloud's stamp and its points' times
constexpr double kAbsoluteFrom = 1e3;   // s: smaller times of points are after the stamp
constexpr std::size_t kBatch = 100000;  // points
constexpr std::size_t kLongest = 255;   // characters of a name in ROS

/// A message of a type, whatever wire it came over. Throws InputError if it is none.
template <class M>
M decoded(Wire wire, const Recorded& message, const std::string& recording, bool is_head = false) {
  const std::span bytes(message.data, message.size);
  auto found = wire == Wire::kCdr ? decode<Wire::kCdr, M>(bytes, is_head)
                                  : decode<Wire::kRos1, M>(bytes, is_head);
  if (found) return std::move(*found);
  throw InputError(fmt::format(
      "{}: a message on {} is no {} that can be read", recording, message.topic, message.type));
}

/// Without its package: "PointCloud2".
std::string_view short_type(std::string_view type) {
  const std::size_t slash = type.rfind('/');
  return type.substr(slash == std::string::npos ? 0 : slash + 1);
}

bool is_cloud(std::string_view type) {
  return short_type(type) == "PointCloud2" || short_type(type) == "CustomMsg";
}

std::string frame_of(const std::string& name) {
  return excerpt(name.starts_with('/') ? name.substr(1) : name, kLongest);
}

SimTime time_of(const msg::Time& stamp) {
  return SimTime(std::chrono::seconds(stamp.sec) + std::chrono::nanoseconds(stamp.nanosec));
}

/// A cloud with what its header says.
struct StampedCloud {
  SimTime time;
  std::string frame;
  CloudMessagePoints content;
};

template <class M>
StampedCloud stamped(const M& cloud) {
  return {time_of(cloud.header.stamp), frame_of(cloud.header.frame_id), points_of(cloud)};
}

StampedCloud cloud_in(Wire wire, const Recorded& message, const std::string& recording) {
  try {
    if (short_type(message.type) == "CustomMsg") {
      return stamped(decoded<msg::CustomMsg>(wire, message, recording));
    }
    return stamped(decoded<msg::PointCloud2>(wire, message, recording));
  } catch (const InputError& error) {
    const std::string what = error.what();
    if (what.starts_with(recording)) throw;
    throw InputError(fmt::format("{}: a cloud on {}: {}", recording, message.topic, what));
  }
}

Pose pose_in(const msg::Point& position, const msg::Quaternion& orientation) {
  return {rotation_of(orientation), vector_of(position)};
}

/// The topic of that name, or the only one that there is.
template <class Topics>
std::string chosen_topic(const Topics& topics,
                         const std::string& wanted,
                         const std::string& recording,
                         const char* what,
                         const char* flag) {
  std::vector<std::string> names;
  names.reserve(topics.size());
  for (const auto& entry : topics) names.push_back(entry.first);
  if (names.empty()) throw InputError(fmt::format("{}: has no {}", recording, what));
  if (!wanted.empty()) {
    if (topics.contains(wanted)) return wanted;
    throw InputError(fmt::format(
        "{}: has no {} on {}; there are: {}", recording, what, wanted, fmt::join(names, ", ")));
  }
  if (names.size() == 1) return names.front();
  throw InputError(fmt::format("{}: has {} on several topics: {}; choose one by {}",
                               recording,
                               what,
                               fmt::join(names, ", "),
                               flag));
}

}  // namespace

/// What a recording holds that a survey could be of.
struct RecordingContents {
  struct Clouds {
    std::string frame;
    bool has_intensity = false;
    std::vector<SimTime> times;
  };
  struct Poses {
    std::string fixed_frame;
    std::string frame;  ///< Of what moves; empty if the messages do not say.
    std::vector<TimedPose> poses;
  };
  std::map<std::string, Clouds> clouds;        ///< By topic.
  std::map<std::string, Poses> poses;          ///< By topic.
  std::map<std::string, std::string> parents;  ///< Of frames in /tf_static.
  std::map<std::string, Pose> T_parent_frame;  ///< Beside them.

  void add(Wire wire, const Recorded& message, const std::string& recording);
  [[nodiscard]] std::optional<Pose> between(const std::string& from, const std::string& to) const;

 private:
  void add_pose(const std::string& topic,
                const msg::Header& header,
                const std::string& frame,
                const Pose& pose);
};

void RecordingContents::add_pose(const std::string& topic,
                                 const msg::Header& header,
                                 const std::string& frame,
                                 const Pose& pose) {
  Poses& all = poses[topic];
  all.fixed_frame = frame_of(header.frame_id);
  all.frame = frame_of(frame);
  const SimTime time = time_of(header.stamp);
  if (!all.poses.empty() && time <= all.poses.back().time) return;  // sent twice
  if (pose.translation.allFinite()) all.poses.push_back({time, pose});
}

void RecordingContents::add(Wire wire, const Recorded& message, const std::string& recording) {
  const std::string_view type = short_type(message.type);
  // no name that a topic can have
  if (message.topic.size() > kLongest || excerpt(message.topic, kLongest) != message.topic) return;
  const std::string topic(message.topic);
  if (is_cloud(message.type)) {
    Clouds& all = clouds[topic];
    if (all.times.empty()) {
      const StampedCloud first = cloud_in(wire, message, recording);
      all.frame = first.frame;
      all.has_intensity = first.content.has_intensity;
    }
    all.times.push_back(time_of(decoded<msg::Header>(wire, message, recording, true).stamp));
  } else if (type == "Odometry") {
    const auto m = decoded<msg::Odometry>(wire, message, recording);
    const msg::Pose& pose = m.pose.pose;
    add_pose(topic, m.header, m.child_frame_id, pose_in(pose.position, pose.orientation));
  } else if (type == "PoseStamped") {
    const auto m = decoded<msg::PoseStamped>(wire, message, recording);
    add_pose(topic, m.header, "", pose_in(m.pose.position, m.pose.orientation));
  } else if (type == "TFMessage" && message.topic.ends_with("tf_static")) {
    for (const auto& t : decoded<msg::TFMessage>(wire, message, recording).transforms) {
      const std::string child = frame_of(t.child_frame_id);
      const Pose pose{rotation_of(t.transform.rotation), vector_of(t.transform.translation)};
      if (!pose.translation.allFinite()) continue;
      parents[child] = frame_of(t.header.frame_id);
      T_parent_frame[child] = pose;
    }
  }
}

/// T_from_to by /tf_static; nothing if they are not joined there.
std::optional<Pose> RecordingContents::between(const std::string& from,
                                               const std::string& to) const {
  const auto climb = [&](std::string frame) {
    Pose T_root_frame;
    for (std::size_t i = 0; i <= parents.size(); ++i) {
      const auto parent = parents.find(frame);
      if (parent == parents.end()) break;
      T_root_frame = T_parent_frame.at(frame) * T_root_frame;
      frame = parent->second;
    }
    return std::pair(frame, T_root_frame);
  };
  const auto [root, T_root_from] = climb(from);
  const auto [other, T_root_to] = climb(to);
  if (root != other) return std::nullopt;
  return T_root_from.inverse() * T_root_to;
}

namespace {

RecordingContents contents_of(const RecordingOpener& opener,
                              const std::string& name,
                              const Progress& progress) {
  RecordingContents contents;
  const auto messages = opener({});
  Recorded message;
  for (std::uint64_t i = 0; messages->next(message); ++i) {
    if (i % 256 == 0) report(progress, "looking for scans and poses", messages->share_read());
    contents.add(messages->wire(), message, name);
  }
  return contents;
}

}  // namespace

/// Clouds one after the other.
class RecordedScanReader : public ScanReader {
 public:
  RecordedScanReader(const RecordedScans& scans, std::function<bool(std::size_t)> chosen)
      : scans_(scans), chosen_(std::move(chosen)), messages_(scans.opener_({scans.topic_})) {}

  bool read(ScanBatch& batch) override {
    if (at_ == cloud_.content.points.size() && !next_cloud()) return false;
    const std::size_t end = std::min(cloud_.content.points.size(), at_ + kBatch);
    const auto first = cloud_.content.points.begin();
    batch.scan = number_ - 1;
    batch.time_unit = cloud_.content.time_unit;
    batch.points.assign(first + static_cast<std::ptrdiff_t>(at_),
                        first + static_cast<std::ptrdiff_t>(end));
    at_ = end;
    return true;
  }
  [[nodiscard]] double share_read() const override { return messages_->share_read(); }

 private:
  bool next_cloud() {
    Recorded message;
    while (messages_->next(message)) {
      if (message.topic != scans_.topic_ || !is_cloud(message.type)) continue;
      if (number_ == scans_.times_.size()) return false;  // it has grown since
      if (chosen_ && !chosen_(number_)) {
        ++number_;
        continue;
      }
      ++number_;
      cloud_ = cloud_in(messages_->wire(), message, scans_.name_);
      set_clock();
      at_ = 0;
      return true;
    }
    return false;
  }

  /// Times since 1970 are of the stamps' clock, or, if that is another, after the first point.
  void set_clock() {
    double first = std::numeric_limits<double>::infinity();
    for (const RecordedPoint& p : cloud_.content.points) {
      if (std::isfinite(p.time)) first = std::min(first, p.time);
    }
    const bool is_absolute = std::isfinite(first) && first >= kAbsoluteFrom;
    if (!is_absolute || !(std::abs(first - to_seconds(cloud_.time)) > kClocksApart)) return;
    for (RecordedPoint& p : cloud_.content.points) p.time -= first;
  }

  const RecordedScans& scans_;
  std::function<bool(std::size_t)> chosen_;
  std::unique_ptr<MessageReader> messages_;
  std::size_t number_ = 0;  ///< Of the next cloud on the topic.
  StampedCloud cloud_;
  std::size_t at_ = 0;  ///< The next point.
};

RecordedScans::RecordedScans(const RecordingOpener& opener,
                             const RecordedSurveyOptions& options,
                             const Progress& progress)
    : RecordedScans(opener, options, contents_of(opener, options.name, progress)) {}

RecordedScans::RecordedScans(RecordingOpener opener,
                             const RecordedSurveyOptions& options,
                             const RecordingContents& contents)
    : opener_(std::move(opener)),
      name_(options.name),
      topic_(chosen_topic(contents.clouds,
                          options.cloud_topic,
                          options.name,
                          "clouds (PointCloud2, CustomMsg)",
                          "--scan-topic")) {
  const RecordingContents::Clouds& clouds = contents.clouds.at(topic_);
  frame_ = clouds.frame;
  has_intensity_ = clouds.has_intensity;
  times_ = clouds.times;
}

double RecordedScans::time(std::size_t scan) const {
  return to_seconds(times_[scan]);
}

std::string RecordedScans::name(std::size_t scan) const {
  return fmt::format("{:06}", scan);
}

std::unique_ptr<ScanReader> RecordedScans::open(
    const std::function<bool(std::size_t)>& chosen) const {
  return std::make_unique<RecordedScanReader>(*this, chosen);
}

RecordedSurvey::RecordedSurvey(const RecordingOpener& opener,
                               const RecordedSurveyOptions& options,
                               const Progress& progress) {
  const RecordingContents contents = contents_of(opener, options.name, progress);
  const auto clouds = std::make_shared<RecordedScans>(opener, options, contents);
  source_ = clouds;
  if (options.is_deskewed) point_times_ = PointTimes::kIgnored;
  take_poses(options, *clouds, contents);
  const std::vector<SimTime>& times = clouds->times();
  const auto& poses = trajectory_.poses;
  for (std::size_t i = 0; i < times.size(); ++i) {
    const bool is_reached = times[i] >= poses.front().time && times[i] <= poses.back().time;
    if (is_reached) scans_.push_back({i, times[i]});
  }
  if (scans_.empty()) {
    throw InputError(
        fmt::format("{}: no scan on {} ({} to {} s) lies within the poses ({} to {} s)",
                    options.name,
                    clouds->topic(),
                    to_seconds(times.front()),
                    to_seconds(times.back()),
                    to_seconds(poses.front().time),
                    to_seconds(poses.back().time)));
  }
  settle_times(options.time_unit, options.name);
  about_ += fmt::format("; {} scans", scans_.size());
  if (scans_.size() < times.size()) {
    about_ += fmt::format(", {} before the first or after the last pose left out",
                          times.size() - scans_.size());
  }
}

void RecordedSurvey::take_poses(const RecordedSurveyOptions& options,
                                const RecordedScans& scans,
                                const RecordingContents& contents) {
  about_ = fmt::format("scans of {} ({})", scans.topic(), scans.frame());
  if (!options.poses.empty()) {
    trajectory_ = read_survey_poses(options.poses, options.T_pose_sensor.value_or(Pose{}));
    if (!trajectory_.has_times) {
      throw InputError(fmt::format(
          "{}: its poses have no times; a recording wants a TUM trajectory", options.poses));
    }
    about_ += fmt::format(", poses of {}", options.poses);
    return;
  }
  const std::string topic = chosen_topic(contents.poses,
                                         options.pose_topic,
                                         options.name,
                                         "poses (Odometry, PoseStamped; or give --poses)",
                                         "--pose-topic");
  const RecordingContents::Poses& poses = contents.poses.at(topic);
  const bool is_registered = scans.frame() == poses.fixed_frame && !scans.frame().empty();
  if (is_registered) point_times_ = PointTimes::kRegistered;
  about_ += fmt::format(", poses of {} ({} in {})", topic, poses.frame, poses.fixed_frame);
  Pose T_pose_sensor;
  if (options.T_pose_sensor) {
    T_pose_sensor = *options.T_pose_sensor;
  } else if (!is_registered && !poses.frame.empty() && !scans.frame().empty()) {
    const auto found = contents.between(poses.frame, scans.frame());
    if (!found) {
      throw InputError(
          fmt::format("{}: the clouds on {} are in the frame '{}', the poses on {} of '{}', and "
                      "/tf_static does not join them; give --sensor-pose",
                      options.name,
                      scans.topic(),
                      scans.frame(),
                      topic,
                      poses.frame));
    }
    T_pose_sensor = *found;
  }
  trajectory_.poses = poses.poses;
  for (TimedPose& pose : trajectory_.poses) pose.pose = pose.pose * T_pose_sensor;
  check_survey_poses(trajectory_.poses, fmt::format("{}: {}", options.name, topic));
}

}  // namespace pointflight
