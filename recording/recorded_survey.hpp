// Surveys as people record them: a bag or MCAP with clouds, and odometry or a trajectory beside it.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "pointflight/core/progress.hpp"
#include "pointflight/fit/recorded_scans.hpp"
#include "pointflight/fit/survey_poses.hpp"
#include "pointflight/fit/survey_rays.hpp"
#include "ros_common/wire.hpp"

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
  /// Where the sensor is in the frame that the poses are of. Nothing: by /tf_static where the
  /// clouds' frame is another than the poses'.
  std::optional<Pose> T_pose_sensor;
  bool is_deskewed = false;  ///< Times of points are left aside.
};

/// The first `most` clouds of a recording on a topic (empty: the only one), whatever their frame.
/// `name`: of the recording, for messages. Throws InputError.
std::vector<RecordedScan> read_recorded_scans(const RecordingOpener& opener,
                                              const std::string& name,
                                              const std::string& cloud_topic,
                                              std::size_t most,
                                              const Progress& progress = {});

/// The scans of a recording whose times the poses reach. Points of clouds in the poses' own fixed
/// frame (FAST-LIO's `cloud_registered`) stay where they are, and the poses say where their rays
/// began; others are in the sensor's frame. Times of points that are not of the stamps' clock count
/// from their cloud's first.
class RecordedSurvey : public SurveySource {
 public:
  /// Reads the recording once, for poses and times of scans. Throws InputError.
  RecordedSurvey(RecordingOpener opener,
                 RecordedSurveyOptions options,
                 const Progress& progress = {});

  [[nodiscard]] std::size_t scan_count() const override { return scans_.size(); }
  [[nodiscard]] std::unique_ptr<SurveyReader> open(
      const std::function<bool(std::size_t scan)>& chosen = {}) const override;

  /// Which topics and frames it took, in words.
  [[nodiscard]] const std::string& about() const { return about_; }

 private:
  friend class RecordedSurveyReader;
  struct Contents;

  void choose_clouds(const Contents& contents);
  void choose_poses(const Contents& contents);

  RecordingOpener opener_;
  RecordedSurveyOptions options_;
  SurveyPoses trajectory_;
  bool is_registered_ = false;  ///< The points lie in the poses' fixed frame.
  bool has_intensity_ = false;
  /// Scans by the number of their message on the topic.
  std::map<std::uint64_t, std::size_t> scans_;
  std::string about_;
};

}  // namespace pointflight
