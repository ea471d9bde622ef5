#include "pointflight/survey/survey_poses.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "pointflight/core/input_error.hpp"
#include "pointflight/io/pose_files.hpp"

namespace pointflight {
namespace {

constexpr double kWorld = 1e9;        // m
constexpr double kLatest = 4.5e9;     // s, the year 2112: differences stay within SimTime
constexpr double kOffsetsEnd = 1000;  // s: larger times of points are no offsets

}  // namespace

SimTime time_of(double seconds, const std::string& location) {
  if (!(std::abs(seconds) < kLatest)) {
    throw InputError(fmt::format("{}: {} is no time in seconds", location, seconds));
  }
  return SimTime(from_seconds(seconds));
}

void check_survey_poses(const std::vector<TimedPose>& poses, const std::string& name) {
  if (poses.empty()) throw InputError(fmt::format("{}: no poses", name));
  for (std::size_t i = 0; i < poses.size(); ++i) {
    if (!(poses[i].pose.translation.cwiseAbs().maxCoeff() < kWorld)) {
      throw InputError(fmt::format("{}: pose {} is not in this world", name, i + 1));
    }
    if (i > 0 && !(poses[i].time > poses[i - 1].time)) {
      throw InputError(fmt::format("{}: pose {} is not later than the one before it", name, i + 1));
    }
  }
}

SurveyPoses read_survey_poses(const std::string& path, const Pose& T_pose_sensor) {
  SurveyPoses trajectory;
  if (is_kitti(path)) {
    trajectory.has_times = false;
    for (const Pose& pose : read_kitti(path)) {
      const SimTime time(std::chrono::seconds(trajectory.poses.size()));
      trajectory.poses.push_back({time, pose * T_pose_sensor});
    }
  } else {
    for (const TumPose& pose : read_tum(path)) {
      trajectory.poses.push_back({time_of(pose.time, path), pose.T_world_sensor * T_pose_sensor});
      if (!pose.file.empty()) trajectory.files.push_back(pose.file);
    }
  }
  check_survey_poses(trajectory.poses, path);
  if (!trajectory.files.empty() && trajectory.files.size() != trajectory.poses.size()) {
    throw InputError(fmt::format("{}: {} of {} poses name their scan; all or none may",
                                 path,
                                 trajectory.files.size(),
                                 trajectory.poses.size()));
  }
  return trajectory;
}

SimTime time_of_point(const std::vector<TimedPose>& poses,
                      SimTime scan_start,
                      double time,
                      const std::string& location) {
  const bool is_offset = std::abs(time) < kOffsetsEnd;
  const double at = is_offset ? to_seconds(scan_start) + time : time;
  const Duration last =
      poses.size() < 2 ? Duration(0) : poses.back().time - poses[poses.size() - 2].time;
  const double slack = std::max(1.0, to_seconds(last));
  if (!(at >= to_seconds(poses.front().time) - slack &&
        at <= to_seconds(poses.back().time) + slack)) {
    throw InputError(fmt::format(
        "{}: a point's time, {} s, is not within the poses ({} to {} s); --deskewed leaves times "
        "of points aside",
        location,
        time,
        to_seconds(poses.front().time),
        to_seconds(poses.back().time)));
  }
  return is_offset ? scan_start + from_seconds(time) : SimTime(from_seconds(time));
}

}  // namespace pointflight
