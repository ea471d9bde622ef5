// A survey of an exact scene as a person makes one of a real place: a LiDAR carried through it.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "pointflight/core/parallel.hpp"
#include "pointflight/core/progress.hpp"
#include "pointflight/fidelity/survey_walk.hpp"
#include "pointflight/lidar/lidar_settings.hpp"
#include "pointflight/survey/survey_rays.hpp"

namespace pointflight {

/// One shot as the sensor reports it.
struct SurveyShot {
  /// Of the return; without one the end of what is free for sure: half of the sensor's greatest
  /// range, m.
  Vector3f position_sensor;
  float time = 0.0f;      ///< Since the scan's start, s.
  bool is_return = true;  ///< False: nothing came back.
};

/// A finished survey.
struct Survey {
  std::vector<TimedPose> walk;                 ///< T_world_sensor in truth, one more than scans.
  std::vector<TimedPose> poses;                ///< Estimated poses at the scans' starts.
  std::vector<std::vector<SurveyShot>> scans;  ///< Each in the order of firing.
};

/// Carries a LiDAR along a walk of its own. Returns nearer than the sensor's least range are lost.
Survey make_survey(const ExactScene& scene,
                   const SceneTree& tree,
                   const LidarSettings& lidar,
                   const SurveyOptions& options,
                   const Executor& executor,
                   const Progress& progress = {});

/// Its rays as the surveyor has them; the survey must outlive the reader.
std::unique_ptr<SurveyReader> rays_of(const Survey& survey);

/// The same as scans; the survey must outlive it.
std::unique_ptr<SurveySource> scans_of(const Survey& survey);

/// Writes `scans/NNNNNN.pcd` (returns: x y z in the sensor frame, m, and time since the scan's
/// start, s), `free/NNNNNN.pcd` (the same of shots without a return, up to where all is free) and
/// `poses.tum` (believed, of the scans' starts) into a folder that is there. Throws InputError.
void write_survey(const Survey& survey, const std::string& folder, const Progress& progress = {});

/// Of the points in each cube `width` wide only the first is kept, as maps are often thinned.
std::unique_ptr<CloudReader> thinned(std::unique_ptr<CloudReader> cloud, double width);

}  // namespace pointflight
