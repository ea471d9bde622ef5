// Surveys as people have them: a folder of scans and a file of poses.
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "pointflight/fit/survey_poses.hpp"
#include "pointflight/fit/survey_rays.hpp"

namespace pointflight {

/// Where a survey lies.
struct SurveyFiles {
  std::string scans;  ///< Folder of clouds in the sensor frame, m.
  /// TUM (`time tx ty tz qx qy qz qw [file]`) or KITTI (rows of a 3 x 4 matrix): T_world_sensor.
  std::string poses;
  /// Folder of clouds under the scans' names, of shots without a return: points up to which all is
  /// free. Empty: none.
  std::string free;
  /// Times of points are left aside: motion within a scan was taken out of it.
  bool is_deskewed = false;
  Pose T_pose_sensor = {};  ///< Where the sensor is in the frame that the poses are of.
};

/// Names of the clouds of a folder, by the numbers that they are, where all are, else as text;
/// without the file `except`. Throws InputError, also where there are none.
std::vector<std::string> scan_files_in(const std::string& folder, const std::string& except = {});

/// A survey in a folder. Which pose is which scan's: by the file's ninth column; else as many poses
/// as there are clouds in the folder, in the order of their names (numbers by size); else the names
/// of the clouds are their times (s or ns) and the poses a trajectory. Points with times of their
/// own get poses between: offsets from the scan's time, or, where they are large, times of the
/// trajectory.
class SurveyFolder : public SurveySource {
 public:
  /// Reads the poses. Throws InputError.
  explicit SurveyFolder(SurveyFiles files);

  [[nodiscard]] std::size_t scan_count() const override { return scans_.size(); }
  [[nodiscard]] std::unique_ptr<SurveyReader> open(
      const std::function<bool(std::size_t scan)>& chosen = {}) const override;

 private:
  friend class SurveyFolderReader;
  struct Scan {
    std::string file;  ///< Name without folder.
    SimTime time;      ///< By the poses' clock.
  };

  void match_scans();

  SurveyFiles files_;
  SurveyPoses trajectory_;
  std::vector<Scan> scans_;
};

}  // namespace pointflight
