// Surveys as people record them: a bag or MCAP with clouds, and odometry or a trajectory beside it.
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "pointflight/core/progress.hpp"
#include "pointflight/ros/common/wire.hpp"
#include "pointflight/survey/posed_scans.hpp"

namespace pointflight {

/// Opens a recording at its beginning: messages of these topics at least, of all without any.
using RecordingOpener =
    std::function<std::unique_ptr<MessageReader>(const std::vector<std::string>& topics)>;

/// What of a recording is the survey.
struct RecordedSurveyOptions {
  std::string name;         ///< Of the recording, for messages.
  std::string cloud_topic;  ///< PointCloud2 or CustomMsg; empty: the only one.
  std::string pose_topic;   ///< Odometry or PoseStamped; empty: the only one.
  std::string poses;        ///< A file of poses of the sensor instead; empty: the pose topic.
  /// Where the sensor is in the frame that the poses are of. Nothing: by /tf_static if the
  /// clouds' frame is another than the poses'.
  std::optional<Pose> T_pose_sensor;
  bool is_deskewed = false;           ///< Times of points are left aside.
  std::optional<TimeUnit> time_unit;  ///< Of times of points; nothing: recognised.
};

/// What a recording holds that a survey could be of.
struct RecordingContents;

/// The clouds on a topic of a recording. Times of points that are not of the stamps' clock count
/// from their cloud's first.
class RecordedScans : public ScanSource {
 public:
  /// Reads the recording once, for the clouds' stamps. Of the options `name` and `cloud_topic`
  /// count. Throws InputError.
  RecordedScans(const RecordingOpener& opener,
                const RecordedSurveyOptions& options,
                const Progress& progress = {});
  /// Of contents that were read before.
  RecordedScans(RecordingOpener opener,
                const RecordedSurveyOptions& options,
                const RecordingContents& contents);

  [[nodiscard]] std::size_t scan_count() const override { return times_.size(); }
  [[nodiscard]] double time(std::size_t scan) const override;
  [[nodiscard]] std::string name(std::size_t scan) const override;
  [[nodiscard]] std::string path(std::size_t /*scan*/) const override { return name_; }
  [[nodiscard]] bool has_intensity() const override { return has_intensity_; }
  [[nodiscard]] std::unique_ptr<ScanReader> open(
      const std::function<bool(std::size_t scan)>& chosen = {}) const override;

  /// Of each scan, by the clock of the stamps.
  [[nodiscard]] const std::vector<SimTime>& times() const { return times_; }
  /// Which topic it is.
  [[nodiscard]] const std::string& topic() const { return topic_; }
  /// The clouds' frame.
  [[nodiscard]] const std::string& frame() const { return frame_; }

 private:
  friend class RecordedScanReader;
  RecordingOpener opener_;
  std::string name_;
  std::string topic_;
  std::string frame_;
  bool has_intensity_ = false;
  std::vector<SimTime> times_;
};

/// The scans of a recording whose times the poses reach. Points of clouds in the poses' own fixed
/// frame (FAST-LIO's `cloud_registered`) stay where they are, and the poses say where their rays
/// began; others are in the sensor's frame.
class RecordedSurvey : public PosedScans {
 public:
  /// Reads the recording once, for poses and times of scans. Throws InputError.
  RecordedSurvey(const RecordingOpener& opener,
                 const RecordedSurveyOptions& options,
                 const Progress& progress = {});

  /// Which topics and frames it took, in words.
  [[nodiscard]] const std::string& about() const { return about_; }

 private:
  void take_poses(const RecordedSurveyOptions& options,
                  const RecordedScans& scans,
                  const RecordingContents& contents);
  std::string about_;
};

}  // namespace pointflight
