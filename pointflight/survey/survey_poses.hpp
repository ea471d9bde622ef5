// Where a sensor was, as files of poses and recordings say it.
#pragma once

#include <string>
#include <vector>

#include "pointflight/core/time.hpp"
#include "pointflight/geometry/motion.hpp"
#include "pointflight/geometry/types.hpp"

namespace pointflight {

/// Poses of a survey.
struct SurveyPoses {
  std::vector<TimedPose> poses;    ///< T_world_sensor by ascending time.
  std::vector<std::string> files;  ///< The scan of each pose; empty if none is named.
  bool has_times = true;           ///< False: the times are 0, 1, 2 s, for the file has none.
};

/// Reads TUM (`time tx ty tz qx qy qz qw [file]`) or KITTI (rows of a 3 x 4 matrix) files. Throws
/// InputError.
SurveyPoses read_survey_poses(const std::string& path, const Pose& T_pose_sensor = {});

/// Throws InputError if poses are none, not in this world or do not ascend; `name` is theirs.
void check_survey_poses(const std::vector<TimedPose>& poses, const std::string& name);

/// Seconds as a time; `location` is theirs. Throws InputError if they are none.
SimTime time_of(double seconds, const std::string& location);

/// When a point was measured that carries a time of its own, s: since its scan's start, or, if
/// that is 1000 s or more, by the poses' clock. Throws InputError that names `location` if the
/// trajectory does not reach there.
SimTime time_of_point(const std::vector<TimedPose>& poses,
                      SimTime scan_start,
                      double time,
                      const std::string& location);

}  // namespace pointflight
