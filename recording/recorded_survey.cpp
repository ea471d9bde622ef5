#include "recording/recorded_survey.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <utility>

#include "pointflight/core/input_error.hpp"
#include "pointflight/io/byte_cursor.hpp"
#include "ros_common/cloud_points.hpp"
#include "ros_common/codec.hpp"
#include "ros_common/conversion.hpp"

namespace pointflight {
namespace {

constexpr double kNearest = 0.01;       // m: the sensor itself
constexpr double kFarthest = 1e6;       // m: no sensor sees so far
constexpr double kClocksApart = 1.0;    // s between a cloud's stamp and its points' times
constexpr double kAbsoluteFrom = 1e3;   // s: smaller times of points are after the stamp
constexpr std::size_t kBatch = 100000;  // rays
constexpr std::size_t kLongest = 255;   // characters of a name in ROS

/// A message of a type, whatever wire it came over. Throws InputError where it is none.
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
std::string_view short_type(const std::string& type) {
  const std::size_t slash = type.rfind('/');
  return std::string_view(type).substr(slash == std::string::npos ? 0 : slash + 1);
}

bool is_cloud(const std::string& type) {
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

}  // namespace

/// What a recording holds that a survey could be of.
struct RecordedSurvey::Contents {
  struct Clouds {
    std::string frame;
    bool has_intensity = false;
    std::vector<SimTime> times;
  };
  struct Poses {
    std::string fixed_frame;
    std::string frame;  ///< Of what moves; empty where the messages do not say.
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

void RecordedSurvey::Contents::add_pose(const std::string& topic,
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

void RecordedSurvey::Contents::add(Wire wire,
                                   const Recorded& message,
                                   const std::string& recording) {
  const std::string_view type = short_type(message.type);
  if (excerpt(message.topic, kLongest) != message.topic) return;  // no name that a topic can have
  if (is_cloud(message.type)) {
    Clouds& all = clouds[message.topic];
    if (all.times.empty()) {
      const StampedCloud first = cloud_in(wire, message, recording);
      all.frame = first.frame;
      all.has_intensity = first.content.has_intensity;
    }
    all.times.push_back(time_of(decoded<msg::Header>(wire, message, recording, true).stamp));
  } else if (type == "Odometry") {
    const auto m = decoded<msg::Odometry>(wire, message, recording);
    const msg::Pose& pose = m.pose.pose;
    add_pose(message.topic, m.header, m.child_frame_id, pose_in(pose.position, pose.orientation));
  } else if (type == "PoseStamped") {
    const auto m = decoded<msg::PoseStamped>(wire, message, recording);
    add_pose(message.topic, m.header, "", pose_in(m.pose.position, m.pose.orientation));
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

/// T_from_to by /tf_static; nothing where they are not joined there.
std::optional<Pose> RecordedSurvey::Contents::between(const std::string& from,
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

/// Clouds one after the other.
class RecordedSurveyReader : public SurveyReader {
 public:
  RecordedSurveyReader(const RecordedSurvey& survey, const std::function<bool(std::size_t)>& chosen)
      : survey_(survey),
        chosen_(chosen),
        messages_(survey.opener_({survey.options_.cloud_topic})) {}

  bool read(std::vector<SurveyRay>& batch) override {
    batch.clear();
    while (batch.empty()) {
      if (next_point_ < cloud_.content.points.size()) {
        add_rays(batch);
      } else if (!next_cloud()) {
        return false;
      }
    }
    return true;
  }
  [[nodiscard]] bool has_intensity() const override { return survey_.has_intensity_; }
  [[nodiscard]] double share_read() const override { return messages_->share_read(); }

 private:
  bool next_cloud() {
    Recorded message;
    while (messages_->next(message)) {
      if (message.topic != survey_.options_.cloud_topic || !is_cloud(message.type)) continue;
      const auto scan = survey_.scans_.find(number_++);
      if (scan == survey_.scans_.end() || (chosen_ && !chosen_(scan->second))) continue;
      cloud_ = cloud_in(messages_->wire(), message, survey_.options_.name);
      next_point_ = 0;
      find_clock();
      return true;
    }
    return false;
  }

  /// Times since 1970 are of the stamps' clock, or, where that is another, after the first point.
  void find_clock() {
    double first = std::numeric_limits<double>::infinity();
    for (const CloudMessagePoint& p : cloud_.content.points) {
      if (std::isfinite(p.time)) first = std::min(first, p.time);
    }
    const bool is_absolute = std::isfinite(first) && first >= kAbsoluteFrom;
    const bool is_apart = std::abs(first - to_seconds(cloud_.time)) > kClocksApart;
    zero_ = is_absolute && is_apart ? first : 0.0;
  }

  void add_rays(std::vector<SurveyRay>& batch) {
    const auto& options = survey_.options_;
    const auto& poses = survey_.trajectory_.poses;
    const bool has_times =
        cloud_.content.has_times && !options.is_deskewed && !survey_.is_registered_;
    const Pose at_stamp = pose_on(poses, cloud_.time);
    const auto& points = cloud_.content.points;
    const std::size_t end = std::min(points.size(), next_point_ + kBatch);
    for (; next_point_ < end; ++next_point_) {
      const CloudMessagePoint& p = points[next_point_];
      Pose pose = at_stamp;
      if (has_times && std::isfinite(p.time)) {
        pose = pose_on(poses, time_of_point(poses, cloud_.time, p.time - zero_, options.name));
      }
      Vector3d seen = p.position;
      if (survey_.is_registered_) {
        seen -= pose.translation;
        pose.rotation.setIdentity();
      }
      const double range = seen.norm();
      if (!(range >= kNearest && range < kFarthest)) continue;  // NaN as well
      if (p.position.isZero(0.0)) continue;                     // drivers say so: no return
      batch.push_back(survey_ray(pose, seen, true));
      batch.back().intensity = p.intensity;
    }
  }

  const RecordedSurvey& survey_;
  std::function<bool(std::size_t)> chosen_;
  std::unique_ptr<MessageReader> messages_;
  std::uint64_t number_ = 0;  ///< Of the next cloud on the topic.
  StampedCloud cloud_;
  double zero_ = 0.0;  ///< What the points' times count from, s.
  std::size_t next_point_ = 0;
};

namespace {

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

std::vector<RecordedScan> read_recorded_scans(const RecordingOpener& opener,
                                              const std::string& name,
                                              const std::string& cloud_topic,
                                              std::size_t most,
                                              const Progress& progress) {
  std::map<std::string, std::vector<RecordedScan>> scans;  // by topic
  const auto messages =
      opener(cloud_topic.empty() ? std::vector<std::string>() : std::vector{cloud_topic});
  Recorded message;
  for (std::uint64_t i = 0; messages->next(message); ++i) {
    if (i % 64 == 0) report(progress, "reading scans", messages->share_read());
    if (!is_cloud(message.type)) continue;
    if (!cloud_topic.empty() && message.topic != cloud_topic) continue;
    std::vector<RecordedScan>& of_topic = scans[excerpt(message.topic, kLongest)];
    if (of_topic.size() == most) {
      if (!cloud_topic.empty()) break;  // enough; else another topic may follow
      continue;
    }
    const StampedCloud cloud = cloud_in(messages->wire(), message, name);
    RecordedScan& scan = of_topic.emplace_back();
    scan.time = to_seconds(cloud.time);
    double first = std::numeric_limits<double>::infinity();
    for (const CloudMessagePoint& p : cloud.content.points) {
      if (std::isfinite(p.time)) first = std::min(first, p.time);
    }
    for (const CloudMessagePoint& p : cloud.content.points) {
      if (p.position.isZero(0.0)) continue;  // drivers say so: no return
      // from the first point on: times since 1970 would lose their last digits further on
      scan.points.push_back({p.position.cast<float>(), p.ring, p.time - first});
    }
  }
  const std::string topic =
      chosen_topic(scans, cloud_topic, name, "clouds (PointCloud2, CustomMsg)", "--scan-topic");
  return std::move(scans.at(topic));
}

RecordedSurvey::RecordedSurvey(RecordingOpener opener,
                               RecordedSurveyOptions options,
                               const Progress& progress)
    : opener_(std::move(opener)), options_(std::move(options)) {
  Contents contents;
  const auto messages = opener_({});
  Recorded message;
  for (std::uint64_t i = 0; messages->next(message); ++i) {
    if (i % 256 == 0) report(progress, "looking for scans and poses", messages->share_read());
    contents.add(messages->wire(), message, options_.name);
  }
  options_.cloud_topic = chosen_topic(contents.clouds,
                                      options_.cloud_topic,
                                      options_.name,
                                      "clouds (PointCloud2, CustomMsg)",
                                      "--scan-topic");
  choose_poses(contents);
  choose_clouds(contents);
}

void RecordedSurvey::choose_poses(const Contents& contents) {
  const Contents::Clouds& clouds = contents.clouds.at(options_.cloud_topic);
  about_ = fmt::format("scans of {} ({})", options_.cloud_topic, clouds.frame);
  if (!options_.poses.empty()) {
    trajectory_ = read_survey_poses(options_.poses, options_.T_pose_sensor.value_or(Pose{}));
    if (!trajectory_.has_times) {
      throw InputError(fmt::format(
          "{}: its poses have no times; a recording wants a TUM trajectory", options_.poses));
    }
    about_ += fmt::format(", poses of {}", options_.poses);
    return;
  }
  const std::string topic = chosen_topic(contents.poses,
                                         options_.pose_topic,
                                         options_.name,
                                         "poses (Odometry, PoseStamped; or give --poses)",
                                         "--pose-topic");
  const Contents::Poses& poses = contents.poses.at(topic);
  is_registered_ = clouds.frame == poses.fixed_frame && !clouds.frame.empty();
  about_ += fmt::format(", poses of {} ({} in {})", topic, poses.frame, poses.fixed_frame);
  Pose T_pose_sensor;
  if (options_.T_pose_sensor) {
    T_pose_sensor = *options_.T_pose_sensor;
  } else if (!is_registered_ && !poses.frame.empty() && !clouds.frame.empty()) {
    const auto found = contents.between(poses.frame, clouds.frame);
    if (!found) {
      throw InputError(
          fmt::format("{}: the clouds on {} are in the frame '{}', the poses on {} of '{}', and "
                      "/tf_static does not join them; give --sensor-pose",
                      options_.name,
                      options_.cloud_topic,
                      clouds.frame,
                      topic,
                      poses.frame));
    }
    T_pose_sensor = *found;
  }
  trajectory_.poses = poses.poses;
  for (TimedPose& pose : trajectory_.poses) pose.pose = pose.pose * T_pose_sensor;
  check_survey_poses(trajectory_.poses, fmt::format("{}: {}", options_.name, topic));
}

void RecordedSurvey::choose_clouds(const Contents& contents) {
  const Contents::Clouds& clouds = contents.clouds.at(options_.cloud_topic);
  has_intensity_ = clouds.has_intensity;
  const auto& poses = trajectory_.poses;
  for (std::size_t i = 0; i < clouds.times.size(); ++i) {
    const bool is_reached =
        clouds.times[i] >= poses.front().time && clouds.times[i] <= poses.back().time;
    if (is_reached) scans_.emplace(i, scans_.size());
  }
  if (scans_.empty()) {
    throw InputError(
        fmt::format("{}: no scan on {} ({} to {} s) lies within the poses ({} to {} s)",
                    options_.name,
                    options_.cloud_topic,
                    to_seconds(clouds.times.front()),
                    to_seconds(clouds.times.back()),
                    to_seconds(poses.front().time),
                    to_seconds(poses.back().time)));
  }
  about_ += fmt::format("; {} scans", scans_.size());
  if (scans_.size() < clouds.times.size()) {
    about_ += fmt::format(", {} before the first or after the last pose left out",
                          clouds.times.size() - scans_.size());
  }
}

std::unique_ptr<SurveyReader> RecordedSurvey::open(
    const std::function<bool(std::size_t)>& chosen) const {
  return std::make_unique<RecordedSurveyReader>(*this, chosen);
}

}  // namespace pointflight
