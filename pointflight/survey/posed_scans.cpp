#include "pointflight/survey/posed_scans.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <map>
#include <utility>

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

}  // namespace

void PosedScans::settle_times(const std::optional<TimeUnit>& given, const std::string& name) {
  constexpr std::size_t kLooks = 5;  // scans
  if (given) time_unit_ = given->seconds;
  if (point_times_ != PointTimes::kUsed || scans_.size() < 3 || !trajectory_.has_times) return;
  std::vector<double> intervals;
  for (std::size_t i = 1; i < scans_.size(); ++i) {
    intervals.push_back(to_seconds(scans_[i].time - scans_[i - 1].time));
  }
  std::nth_element(intervals.begin(),
                   intervals.begin() + static_cast<std::ptrdiff_t>(intervals.size() / 2),
                   intervals.end());
  const double interval = intervals[intervals.size() / 2];
  std::map<std::size_t, TimesOfScan> times;
  ScanBatch batch;
  // with one more, whose first points say that the others are complete: no recording is read on
  const std::size_t looks = std::min(kLooks + 1, scans_.size());
  const auto reader = source_->open([&](std::size_t scan) {
    return std::any_of(scans_.begin(),
                       scans_.begin() + static_cast<std::ptrdiff_t>(looks),
                       [&](const Posed& posed) { return posed.number == scan; });
  });
  while (times.size() <= kLooks && reader->read(batch)) {
    TimesOfScan& scan = times[batch.scan];
    scan.unit = batch.time_unit;
    for (const RecordedPoint& point : batch.points) {
      if (!std::isfinite(point.time)) continue;
      scan.first = std::min(scan.first, point.time);
      scan.last = std::max(scan.last, point.time);
    }
  }
  if (times.size() > kLooks) times.erase(std::prev(times.end()));
  std::vector<TimesOfScan> with;
  for (const auto& [number, scan] : times) {
    if (scan.any()) with.push_back(scan);
  }
  if (with.empty()) {
    about_times_ = fmt::format(
        "{}: its points have no times (time, t, timestamp, offset_time): motion within a scan is "
        "not taken out, and surfaces smear while the sensor turns",
        name);
    return;
  }
  std::nth_element(with.begin(),
                   with.begin() + static_cast<std::ptrdiff_t>(with.size() / 2),
                   with.end(),
                   [](const auto& a, const auto& b) { return a.span() < b.span(); });
  const TimesOfScan& usual = with[with.size() / 2];
  const double raw = usual.span() / usual.unit;
  const double unit = given ? given->seconds : usual.unit;
  if (raw == 0.0 || !(interval > 0.0) || fits_interval(raw * unit, interval)) return;
  const auto found = given ? std::nullopt : unit_by_span(raw, interval);
  if (found) time_unit_ = found->seconds;
  about_times_ = fmt::format(
      "{}: times of points are taken to be in {}: {}; --time-unit says otherwise",
      name,
      found              ? found->name
      : given            ? given->name
      : usual.unit < 1.0 ? "ns"
                         : "s",
      found ? fmt::format(
                  "scans come every {:.3g} s and take {:.3g} s so", interval, raw * found->seconds)
            : fmt::format(
                  "a scan takes {:.3g} s so, and scans come every {:.3g} s; surfaces may smear",
                  raw * unit,
                  interval));
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
