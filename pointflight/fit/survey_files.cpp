#include "pointflight/fit/survey_files.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <filesystem>
#include <optional>
#include <system_error>
#include <utility>

#include "pointflight/core/input_error.hpp"
#include "pointflight/core/mapped_file.hpp"
#include "pointflight/io/byte_cursor.hpp"
#include "pointflight/io/cloud_reader.hpp"

namespace pointflight {
namespace {

namespace fs = std::filesystem;

constexpr double kNearest = 0.01;  // m: the sensor itself
constexpr double kFarthest = 1e6;  // m: no sensor sees so far

/// By the numbers that the names are, where all are; else as text.
void sort_names(std::vector<std::string>& names) {
  const auto number = [](const std::string& name) -> std::optional<double> {
    double value = 0.0;
    if (!parse_number(fs::path(name).stem().string(), value) || !std::isfinite(value)) {
      return std::nullopt;
    }
    return value;
  };
  const bool numbers = std::all_of(names.begin(), names.end(), [&](const std::string& name) {
    return number(name).has_value();
  });
  std::sort(names.begin(), names.end(), [&](const std::string& a, const std::string& b) {
    return numbers ? std::pair(*number(a), a) < std::pair(*number(b), b) : a < b;
  });
}

/// Throws where no scan has a cloud of shots without a return.
void check_free(const SurveyFiles& files, const std::vector<std::string>& scans) {
  if (files.free.empty()) return;
  for (const std::string& scan : scans) {
    std::error_code ignored;
    if (fs::is_regular_file(fs::path(files.free) / scan, ignored)) return;
  }
  throw InputError(fmt::format("{}: no cloud under a scan's name", files.free));
}

}  // namespace

std::vector<std::string> scan_files_in(const std::string& folder, const std::string& except) {
  constexpr std::array kExtensions = {".pcd", ".ply", ".las", ".xyz", ".csv", ".asc", ".pts"};
  std::vector<std::string> names;
  std::error_code error;
  for (fs::directory_iterator at(folder, error); !error && at != fs::directory_iterator();
       at.increment(error)) {
    std::error_code ignored;
    std::string extension = at->path().extension().string();
    std::transform(extension.begin(), extension.end(), extension.begin(), [](unsigned char c) {
      return static_cast<char>(std::tolower(c));
    });
    const bool is_cloud =
        std::find(kExtensions.begin(), kExtensions.end(), extension) != kExtensions.end();
    if (!is_cloud || !at->is_regular_file(ignored)) continue;
    if (fs::equivalent(at->path(), except, ignored)) continue;
    names.push_back(at->path().filename().string());
  }
  if (error) throw InputError(fmt::format("{}: {}", folder, error.message()));
  if (names.empty()) throw InputError(fmt::format("{}: no clouds (.pcd, .ply, ...)", folder));
  sort_names(names);
  return names;
}

/// One scan after the other, its returns and then its shots without one.
class SurveyFolderReader : public SurveyReader {
 public:
  SurveyFolderReader(const SurveyFolder& folder, const std::function<bool(std::size_t)>& chosen)
      : folder_(folder) {
    for (std::size_t i = 0; i < folder.scans_.size(); ++i) {
      if (!chosen || chosen(i)) scans_.push_back(i);
    }
    open_next();
  }

  bool read(std::vector<SurveyRay>& batch) override {
    batch.clear();
    while (cloud_ != nullptr && batch.empty()) {
      if (!cloud_->read(points_)) {
        open_next();
        continue;
      }
      add_points(batch);
    }
    return !batch.empty();
  }
  [[nodiscard]] bool has_intensity() const override { return has_intensity_; }
  [[nodiscard]] double share_read() const override {
    return scans_.empty() ? 1.0 : static_cast<double>(next_) / static_cast<double>(scans_.size());
  }

 private:
  void open_next() {
    const SurveyFiles& files = folder_.files_;
    if (is_return_ && next_ > 0 && !files.free.empty()) {
      const fs::path path = fs::path(files.free) / scan().file;
      std::error_code ignored;
      if (fs::is_regular_file(path, ignored)) {
        is_return_ = false;
        cloud_ = open_cloud(path.string());
        return;
      }
    }
    is_return_ = true;
    cloud_ = nullptr;
    if (next_ == scans_.size()) return;
    ++next_;
    cloud_ = open_cloud(path());
    has_intensity_ = cloud_->has_intensity();
  }

  [[nodiscard]] const SurveyFolder::Scan& scan() const { return folder_.scans_[scans_[next_ - 1]]; }
  [[nodiscard]] std::string path() const {
    return (fs::path(folder_.files_.scans) / scan().file).string();
  }

  void add_points(std::vector<SurveyRay>& batch) {
    const SimTime start = scan().time;
    const std::span<const double> times = cloud_->times();
    const bool has_times = !times.empty() && !folder_.files_.is_deskewed;
    if (has_times && !folder_.trajectory_.has_times) {
      throw InputError(
          fmt::format("{}: its points have times and the poses of {} have none; give a "
                      "TUM trajectory, or --deskewed where motion was taken out",
                      path(),
                      folder_.files_.poses));
    }
    const std::vector<TimedPose>& poses = folder_.trajectory_.poses;
    const Pose at_start = pose_on(poses, start);
    for (std::size_t i = 0; i < points_.size(); ++i) {
      const Vector3d& p = points_[i].position;
      const double range = p.norm();
      if (!(range >= kNearest && range < kFarthest)) continue;
      Pose pose = at_start;
      if (has_times && std::isfinite(times[i])) {
        pose = pose_on(poses, time_of_point(poses, start, times[i], path()));
      }
      batch.push_back(survey_ray(pose, p, is_return_));
      batch.back().intensity = points_[i].intensity;
    }
  }

  const SurveyFolder& folder_;
  std::vector<std::size_t> scans_;
  std::size_t next_ = 0;
  bool is_return_ = true;
  bool has_intensity_ = false;
  std::unique_ptr<CloudReader> cloud_;
  std::vector<CloudPoint> points_;
};

SurveyFolder::SurveyFolder(SurveyFiles files)
    : files_(std::move(files)), trajectory_(read_survey_poses(files_.poses, files_.T_pose_sensor)) {
  match_scans();
}

void SurveyFolder::match_scans() {
  const std::vector<TimedPose>& poses = trajectory_.poses;
  const std::vector<std::string> names =
      trajectory_.files.empty() ? scan_files_in(files_.scans, files_.poses) : trajectory_.files;
  check_free(files_, names);
  if (names.size() == poses.size()) {
    for (std::size_t i = 0; i < names.size(); ++i) scans_.push_back({names[i], poses[i].time});
    return;
  }
  constexpr double kSecondsEnd = 1e11;
  for (const std::string& name : names) {
    double time = 0.0;
    const std::string stem = fs::path(name).stem().string();
    if (!parse_number(stem, time)) {
      throw InputError(fmt::format(
          "{}: {} poses for {} scans in {}; name the scan of each pose in a ninth column, or name "
          "the scans by their times",
          files_.poses,
          poses.size(),
          names.size(),
          files_.scans));
    }
    if (time > kSecondsEnd) time *= 1e-9;
    const std::string path = (fs::path(files_.scans) / name).string();
    const SimTime at = time_of(time, path);
    if (at < poses.front().time || at > poses.back().time) {
      throw InputError(fmt::format("{}: its time is not within the poses of {} ({} to {} s)",
                                   path,
                                   files_.poses,
                                   to_seconds(poses.front().time),
                                   to_seconds(poses.back().time)));
    }
    scans_.push_back({name, at});
  }
}

std::unique_ptr<SurveyReader> SurveyFolder::open(
    const std::function<bool(std::size_t)>& chosen) const {
  return std::make_unique<SurveyFolderReader>(*this, chosen);
}

}  // namespace pointflight
