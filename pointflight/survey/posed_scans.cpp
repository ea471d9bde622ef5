#include "pointflight/survey/posed_scans.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "pointflight/core/input_error.hpp"

namespace pointflight {
namespace {

constexpr double kNearest = 0.01;  // m: the sensor itself
constexpr double kFarthest = 1e6;  // m: no sensor sees so far
constexpr double kMostApart =
    2.0;  // s between poses: farther apart they say nothing of a scan's motion

}  // namespace

/// Batch by batch, as the source gives them.
class PosedScanReader : public SurveyReader {
 public:
  PosedScanReader(const PosedScans& survey, const std::function<bool(std::size_t)>& chosen)
      : survey_(survey), has_intensity_(survey.source_->has_intensity()) {
    number_of_.resize(survey.source_->scan_count(), kNone);
    for (std::size_t i = 0; i < survey.scans_.size(); ++i) {
      if (!chosen || chosen(i)) number_of_[survey.scans_[i].number] = i;
    }
    scans_ = survey.source_->open([this](std::size_t scan) { return number_of_[scan] != kNone; });
  }

  bool read(std::vector<SurveyRay>& batch) override {
    batch.clear();
    while (batch.empty()) {
      if (!scans_->read(points_)) return false;
      add_rays(batch);
    }
    return true;
  }
  [[nodiscard]] std::size_t scan() const override { return number_of_[points_.scan]; }
  [[nodiscard]] bool has_intensity() const override { return has_intensity_; }
  [[nodiscard]] double share_read() const override { return scans_->share_read(); }

 private:
  void add_rays(std::vector<SurveyRay>& batch) {
    const std::vector<TimedPose>& poses = survey_.trajectory_.poses;
    const SimTime start = survey_.scans_[scan()].time;
    const bool is_registered = survey_.point_times_ == PosedScans::PointTimes::kRegistered;
    const bool uses_times = survey_.point_times_ == PosedScans::PointTimes::kUsed &&
                            poses_apart(poses, start) <= kMostApart;
    const Pose at_start = pose_on(poses, start);
    const std::string path = uses_times ? survey_.source_->path(points_.scan) : "";
    const double scale = survey_.time_unit_ > 0.0 ? survey_.time_unit_ / points_.time_unit : 1.0;
    for (const RecordedPoint& point : points_.points) {
      if (point.position.isZero(0.0)) continue;  // drivers say so: no return
      Pose pose = at_start;
      Vector3d seen = point.position;
      if (is_registered) {
        seen -= pose.translation;
        pose.rotation.setIdentity();
      }
      const double range = seen.norm();
      if (!(range >= kNearest && range < kFarthest)) continue;  // NaN as well
      if (uses_times && std::isfinite(point.time)) pose = pose_of(scale * point.time, start, path);
      batch.push_back(survey_ray(pose, seen, points_.is_return));
      batch.back().intensity = point.intensity;
    }
  }

  /// Of a point with a time; `path` is its scan's, for messages.
  [[nodiscard]] Pose pose_of(double time, SimTime start, const std::string& path) const {
    const SurveyPoses& trajectory = survey_.trajectory_;
    if (!trajectory.has_times) {
      throw InputError(
          fmt::format("{}: its points have times and the poses of {} have none; give a TUM "
                      "trajectory, or --deskewed if motion was taken out",
                      path,
                      survey_.poses_name_));
    }
    return pose_on(trajectory.poses, time_of_point(trajectory.poses, start, time, path));
  }

  static constexpr auto kNone = static_cast<std::size_t>(-1);
  const PosedScans& survey_;
  bool has_intensity_;
  std::vector<std::size_t> number_of_;  ///< Of each scan of the source; kNone: not read.
  std::unique_ptr<ScanReader> scans_;
  ScanBatch points_;
};

std::string PosedScans::name(std::size_t scan) const {
  return source_->name(scans_[scan].number);
}

Pose PosedScans::pose(std::size_t scan) const {
  return pose_on(trajectory_.poses, scans_[scan].time);
}

std::unique_ptr<SurveyReader> PosedScans::open(
    const std::function<bool(std::size_t)>& chosen) const {
  return std::make_unique<PosedScanReader>(*this, chosen);
}

namespace {

/// Times of a scan's points.
struct TimesOfScan {
  double first = std::numeric_limits<double>::infinity();
  double last = -std::numeric_limits<double>::infinity();
  double unit = 1.0;  ///< That they were taken to be in, s.
  [[nodiscard]] bool any() const { return first <= last; }
  [[nodiscard]] double span() const { return last - first; }
};

/// Those of the first scans of a reader that have times, at most `most`; it is not read on.
std::vector<TimesOfScan> times_of_first_scans(ScanReader& reader, std::size_t most) {
  std::vector<TimesOfScan> scans;
  ScanBatch batch;
  std::size_t read = 0;  // scans
  for (std::optional<std::size_t> scan; reader.read(batch);) {
    if (scan != batch.scan) {
      if (read++ == most) break;  // the others are complete
      scan = batch.scan;
      if (scans.empty() || scans.back().any()) scans.emplace_back();
    }
    scans.back().unit = batch.time_unit;
    for (const RecordedPoint& point : batch.points) {
      if (!std::isfinite(point.time)) continue;
      scans.back().first = std::min(scans.back().first, point.time);
      scans.back().last = std::max(scans.back().last, point.time);
    }
  }
  if (!scans.empty() && !scans.back().any()) scans.pop_back();
  return scans;
}

/// The median by a measure of each.
template <class T, class Measure>
T median_by(std::vector<T> values, const Measure& measure) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end(), [&](const T& a, const T& b) {
    return measure(a) < measure(b);
  });
  return *middle;
}

}  // namespace

void PosedScans::settle_times(const std::optional<TimeUnit>& given, const std::string& name) {
  constexpr std::size_t kLooks = 5;  // scans
  if (given) time_unit_ = given->seconds;
  if (point_times_ != PointTimes::kUsed || scans_.size() < 3 || !trajectory_.has_times) return;
  std::vector<double> intervals;
  for (std::size_t i = 1; i < scans_.size(); ++i) {
    intervals.push_back(to_seconds(scans_[i].time - scans_[i - 1].time));
  }
  const double interval = median_by(intervals, [](double seconds) { return seconds; });
  const std::size_t first = scans_.front().number;
  const auto reader = source_->open([first](std::size_t scan) { return scan >= first; });
  const std::vector<TimesOfScan> times = times_of_first_scans(*reader, kLooks);
  if (times.empty()) {
    about_times_ = fmt::format(
        "{}: its points have no times (time, t, timestamp, offset_time): motion within a scan is "
        "not taken out, and surfaces smear while the sensor turns",
        name);
    return;
  }
  const TimesOfScan usual = median_by(times, [](const TimesOfScan& scan) { return scan.span(); });
  const SettledUnit settled =
      settled_unit(usual.span() / usual.unit, usual.unit, interval, given, name);
  if (settled.seconds != usual.unit) time_unit_ = settled.seconds;
  about_times_ = settled.said;
}

SurveyFolder::SurveyFolder(const SurveyFiles& files) {
  trajectory_ = read_survey_poses(files.poses, files.T_pose_sensor);
  poses_name_ = files.poses;
  if (files.is_deskewed) point_times_ = PointTimes::kIgnored;
  std::vector<std::string> names =
      trajectory_.files.empty() ? scan_files_in(files.scans, files.poses) : trajectory_.files;
  source_ = std::make_shared<ScanFolder>(files.scans, names, files.free);
  const std::vector<TimedPose>& poses = trajectory_.poses;
  if (names.size() == poses.size()) {
    for (std::size_t i = 0; i < names.size(); ++i) scans_.push_back({i, poses[i].time});
    settle_times(files.time_unit, files.scans);
    return;
  }
  for (std::size_t i = 0; i < names.size(); ++i) {
    const auto time = seconds_in_name(names[i]);
    if (!time) {
      throw InputError(fmt::format(
          "{}: {} poses for {} scans in {}; name the scan of each pose in a ninth column, or name "
          "the scans by their times",
          files.poses,
          poses.size(),
          names.size(),
          files.scans));
    }
    const std::string path = source_->path(i);
    const SimTime at = time_of(*time, path);
    if (at < poses.front().time || at > poses.back().time) {
      throw InputError(fmt::format("{}: its time is not within the poses of {} ({} to {} s)",
                                   path,
                                   files.poses,
                                   to_seconds(poses.front().time),
                                   to_seconds(poses.back().time)));
    }
    scans_.push_back({i, at});
  }
  settle_times(files.time_unit, files.scans);
}

}  // namespace pointflight
