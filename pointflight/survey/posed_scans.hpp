// Scans with poses: a survey, wherever the scans and the poses come from.
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "pointflight/survey/scan_source.hpp"
#include "pointflight/survey/survey_poses.hpp"
#include "pointflight/survey/survey_rays.hpp"
#include "pointflight/survey/time_unit.hpp"

namespace pointflight {

/// Scans of a source, each point with the pose that the sensor had when it was measured; if the
/// poses are more than 2 s apart, that of the scan's stamp. Points nearer than 1 cm or farther than
/// 1000 km are none.
class PosedScans : public SurveySource {
 public:
  [[nodiscard]] std::size_t scan_count() const override { return scans_.size(); }
  [[nodiscard]] std::string name(std::size_t scan) const override;
  [[nodiscard]] Pose pose(std::size_t scan) const override;
  [[nodiscard]] std::unique_ptr<SurveyReader> open(
      const std::function<bool(std::size_t scan)>& chosen = {}) const override;

  /// What a person should know of the times of the points; empty: nothing.
  [[nodiscard]] const std::string& about_times() const { return about_times_; }

 protected:
  /// Reads the first scans and settles the unit of their points' times: the given one, or the one
  /// that was assumed, or, if a scan would take no time that fits the scans' interval in it,
  /// another in which it does. To be called when all else is there; `name` is for messages.
  void settle_times(const std::optional<TimeUnit>& given, const std::string& name);

  /// A scan of the source whose pose is known.
  struct Posed {
    std::size_t number = 0;  ///< In the source.
    SimTime time;            ///< By the poses' clock.
  };
  /// Which times of points count.
  enum class PointTimes {
    kUsed,       ///< Each point gets a pose of its own.
    kIgnored,    ///< Motion within the scans was taken out: one pose for all points.
    kRegistered  ///< The same, and the points lie in the poses' own fixed frame.
  };

  std::shared_ptr<const ScanSource> source_;    ///< What is read.
  SurveyPoses trajectory_;                      ///< Of the sensor.
  std::string poses_name_;                      ///< Where the poses are from, for messages.
  std::vector<Posed> scans_;                    ///< Those with a pose, in the source's order.
  PointTimes point_times_ = PointTimes::kUsed;  ///< As the source needs it.

 private:
  double time_unit_ = 0.0;  ///< s; 0: as the source assumes.
  std::string about_times_;
  friend class PosedScanReader;
};

/// Where a survey lies.
struct SurveyFiles {
  std::string scans;  ///< Folder of clouds in the sensor frame, m.
  /// TUM (`time tx ty tz qx qy qz qw [file]`) or KITTI (rows of a 3 x 4 matrix): T_world_sensor.
  std::string poses;
  /// Folder of clouds under the scans' names, of shots without a return: points up to which all is
  /// free. Empty: none.
  std::string free;
  /// Times of points are ignored: motion within a scan was taken out of it.
  bool is_deskewed = false;
  Pose T_pose_sensor = {};  ///< Where the sensor is in the frame that the poses are of.
  std::optional<TimeUnit> time_unit = {};  ///< Of times of points; nothing: recognised.
};

/// A survey in a folder. Which pose is which scan's: by the file's ninth column; else as many poses
/// as there are clouds in the folder, in the order of their names (numbers by size); else the names
/// of the clouds are their times (s or ns) and the poses a trajectory. Points with times of their
/// own get poses between: offsets from the scan's time, or, if they are large, times of the
/// trajectory.
class SurveyFolder : public PosedScans {
 public:
  /// Reads the poses. Throws InputError.
  explicit SurveyFolder(const SurveyFiles& files);
};

}  // namespace pointflight
