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
#include "pointflight/io/tum.hpp"

namespace pointflight {
namespace {

namespace fs = std::filesystem;

constexpr double kNearest = 0.01;     // m: the sensor itself
constexpr double kFarthest = 1e6;     // m: no sensor sees so far
constexpr double kWorld = 1e9;        // m
constexpr double kLatest = 4.5e9;     // s, the year 2112: differences stay within SimTime
constexpr double kOffsetsEnd = 1000;  // s: larger times of points are no offsets

SimTime time_of(double seconds, const std::string& place) {
  if (!(std::abs(seconds) < kLatest)) {
    throw InputError(fmt::format("{}: {} is no time in seconds", place, seconds));
  }
  return SimTime(from_seconds(seconds));
}

bool is_kitti(const std::string& path) {
  const MappedFile file(path);
  LineCursor lines(as_text(file.bytes()));
  std::string_view line;
  while (lines.next(line)) {
    std::size_t words = 0;
    for (auto word = take_word(line); !word.empty(); word = take_word(line)) {
      if (words == 0 && word.front() == '#') break;
      ++words;
    }
    if (words > 0) return words == 12;
  }
  return false;
}

/// Rows of R | t, of scans one second apart, for the file has no times.
std::vector<TimedPose> read_kitti(const std::string& path) {
  const MappedFile file(path);
  LineCursor lines(as_text(file.bytes()));
  std::vector<TimedPose> poses;
  std::string_view line;
  while (lines.next(line)) {
    std::string_view word = take_word(line);
    if (word.empty() || word.front() == '#') continue;
    std::array<double, 12> v{};
    for (double& value : v) {
      if (!parse_number(word, value) || !std::isfinite(value)) {
        throw InputError(fmt::format("{}:{}: '{}' is no number; twelve are wanted (KITTI)",
                                     path,
                                     lines.number(),
                                     excerpt(word)));
      }
      word = take_word(line);
    }
    Matrix3d rotation;
    rotation << v[0], v[1], v[2], v[4], v[5], v[6], v[8], v[9], v[10];
    if (!((rotation * rotation.transpose() - Matrix3d::Identity()).norm() <= 0.01) ||
        !(rotation.determinant() > 0.0)) {
      throw InputError(
          fmt::format("{}:{}: the first three columns are no rotation", path, lines.number()));
    }
    TimedPose pose;
    pose.time = SimTime(std::chrono::seconds(poses.size()));
    pose.pose = {Quaterniond(rotation).normalized(), {v[3], v[7], v[11]}};
    poses.push_back(pose);
  }
  if (poses.empty()) throw InputError(fmt::format("{}: no poses", path));
  return poses;
}

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

std::vector<std::string> clouds_of(const std::string& folder, const std::string& poses) {
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
    if (fs::equivalent(at->path(), poses, ignored)) continue;
    names.push_back(at->path().filename().string());
  }
  if (error) throw InputError(fmt::format("{}: {}", folder, error.message()));
  if (names.empty()) throw InputError(fmt::format("{}: no clouds (.pcd, .ply, ...)", folder));
  sort_names(names);
  return names;
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
    cloud_ = open_cloud((fs::path(files.scans) / scan().file).string());
    has_intensity_ = cloud_->has_intensity();
  }

  [[nodiscard]] const SurveyFolder::Scan& scan() const { return folder_.scans_[scans_[next_ - 1]]; }

  /// Of a point with a time of its own: an offset from the scan's, or a time of the trajectory.
  [[nodiscard]] SimTime time_of_point(SimTime start, double time) const {
    const bool is_offset = std::abs(time) < kOffsetsEnd;
    const auto& poses = folder_.poses_;
    const double at = is_offset ? to_seconds(start) + time : time;
    const Duration last =
        poses.size() < 2 ? Duration(0) : poses.back().time - poses[poses.size() - 2].time;
    const double slack = std::max(1.0, to_seconds(last));
    if (!(at >= to_seconds(poses.front().time) - slack &&
          at <= to_seconds(poses.back().time) + slack)) {
      throw InputError(fmt::format(
          "{}: a point's time, {} s, is not within the poses of {} ({} to {} s); --deskewed leaves "
          "times of points aside",
          (fs::path(folder_.files_.scans) / scan().file).string(),
          time,
          folder_.files_.poses,
          to_seconds(poses.front().time),
          to_seconds(poses.back().time)));
    }
    return is_offset ? start + from_seconds(time) : SimTime(from_seconds(time));
  }

  void add_points(std::vector<SurveyRay>& batch) {
    const SimTime start = scan().time;
    const std::span<const double> times = cloud_->times();
    const bool has_times = !times.empty() && !folder_.files_.is_deskewed;
    if (has_times && !folder_.poses_have_times_) {
      throw InputError(
          fmt::format("{}: its points have times and the poses of {} have none; give a "
                      "TUM trajectory, or --deskewed where motion was taken out",
                      (fs::path(folder_.files_.scans) / scan().file).string(),
                      folder_.files_.poses));
    }
    const Pose at_start = pose_on(folder_.poses_, start);
    for (std::size_t i = 0; i < points_.size(); ++i) {
      const Vector3d& p = points_[i].position;
      const double range = p.norm();
      if (!(range >= kNearest && range < kFarthest)) continue;
      Pose pose = at_start;
      if (has_times && std::isfinite(times[i])) {
        pose = pose_on(folder_.poses_, time_of_point(start, times[i]));
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

SurveyFolder::SurveyFolder(SurveyFiles files) : files_(std::move(files)) {
  std::vector<std::string> named;
  if (is_kitti(files_.poses)) {
    poses_ = read_kitti(files_.poses);
    poses_have_times_ = false;
  } else {
    for (const TumPose& pose : read_tum(files_.poses)) {
      poses_.push_back({time_of(pose.time, files_.poses), pose.T_world_sensor});
      if (!pose.file.empty()) named.push_back(pose.file);
    }
  }
  for (std::size_t i = 0; i < poses_.size(); ++i) {
    if (poses_[i].pose.translation.cwiseAbs().maxCoeff() < kWorld) continue;
    throw InputError(fmt::format("{}: pose {} is not in this world", files_.poses, i + 1));
  }
  for (std::size_t i = 1; i < poses_.size(); ++i) {
    if (poses_[i].time > poses_[i - 1].time) continue;
    throw InputError(
        fmt::format("{}: pose {} is not later than the one before it", files_.poses, i + 1));
  }
  if (!named.empty() && named.size() != poses_.size()) {
    throw InputError(fmt::format("{}: {} of {} poses name their scan; all or none may",
                                 files_.poses,
                                 named.size(),
                                 poses_.size()));
  }
  match_scans(named);
}

void SurveyFolder::match_scans(const std::vector<std::string>& named) {
  const std::vector<std::string> names =
      named.empty() ? clouds_of(files_.scans, files_.poses) : named;
  check_free(files_, names);
  if (names.size() == poses_.size()) {
    for (std::size_t i = 0; i < names.size(); ++i) scans_.push_back({names[i], poses_[i].time});
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
          poses_.size(),
          names.size(),
          files_.scans));
    }
    if (time > kSecondsEnd) time *= 1e-9;
    const std::string path = (fs::path(files_.scans) / name).string();
    const SimTime at = time_of(time, path);
    if (at < poses_.front().time || at > poses_.back().time) {
      throw InputError(fmt::format("{}: its time is not within the poses of {} ({} to {} s)",
                                   path,
                                   files_.poses,
                                   to_seconds(poses_.front().time),
                                   to_seconds(poses_.back().time)));
    }
    scans_.push_back({name, at});
  }
}

std::unique_ptr<SurveyReader> SurveyFolder::open(
    const std::function<bool(std::size_t)>& chosen) const {
  return std::make_unique<SurveyFolderReader>(*this, chosen);
}

}  // namespace pointflight
