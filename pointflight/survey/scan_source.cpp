#include "pointflight/survey/scan_source.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <optional>
#include <system_error>
#include <utility>

#include "pointflight/core/input_error.hpp"
#include "pointflight/io/byte_cursor.hpp"
#include "pointflight/io/cloud_reader.hpp"

namespace pointflight {
namespace {

namespace fs = std::filesystem;

constexpr double kNanosFrom = 1e11;  // larger numbers are no seconds

/// By the numbers that the names are, if all are; else as text.
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

}  // namespace

std::optional<double> seconds_in_name(const std::string& file) {
  double number = 0.0;
  if (!parse_number(fs::path(file).stem().string(), number)) return std::nullopt;
  return number > kNanosFrom ? 1e-9 * number : number;
}

std::vector<std::string> scan_files_in(const std::string& folder, const std::string& except) {
  std::vector<std::string> names;
  std::error_code error;
  for (fs::directory_iterator at(folder, error); !error && at != fs::directory_iterator();
       at.increment(error)) {
    std::error_code ignored;
    const std::string extension = at->path().extension().string();
    const bool is_notes = extension == ".txt" || extension == ".TXT";  // or poses
    const bool is_cloud = has_cloud_extension(at->path().string()) && !is_notes;
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
class ScanFolderReader : public ScanReader {
 public:
  ScanFolderReader(const ScanFolder& folder, const std::function<bool(std::size_t)>& chosen)
      : folder_(folder) {
    for (std::size_t i = 0; i < folder.scan_count(); ++i) {
      if (!chosen || chosen(i)) scans_.push_back(i);
    }
    open_next();
  }

  bool read(ScanBatch& batch) override {
    while (cloud_ != nullptr) {
      if (cloud_->read(points_)) {
        fill(batch);
        return true;
      }
      open_next();
    }
    return false;
  }
  [[nodiscard]] double share_read() const override {
    return scans_.empty() ? 1.0 : static_cast<double>(next_) / static_cast<double>(scans_.size());
  }

 private:
  void open_next() {
    if (is_return_ && next_ > 0 && !folder_.free_.empty()) {
      const fs::path path = fs::path(folder_.free_) / folder_.name(scans_[next_ - 1]);
      std::error_code ignored;
      if (fs::is_regular_file(path, ignored)) {
        is_return_ = false;
        cloud_ = open_cloud(path.string());
        return;
      }
    }
    is_return_ = true;
    cloud_ = nullptr;
    if (next_ < scans_.size()) cloud_ = open_cloud(folder_.path(scans_[next_++]));
  }

  void fill(ScanBatch& batch) const {
    batch.scan = scans_[next_ - 1];
    batch.is_return = is_return_;
    batch.time_unit = cloud_->time_unit();
    batch.points.resize(points_.size());
    const auto times = cloud_->times();
    const auto rings = cloud_->rings();
    for (std::size_t i = 0; i < points_.size(); ++i) {
      RecordedPoint& point = batch.points[i];
      point = {points_[i].position, points_[i].intensity};
      if (!times.empty()) point.time = times[i];
      if (!rings.empty()) point.ring = rings[i];
    }
  }

  const ScanFolder& folder_;
  std::vector<std::size_t> scans_;
  std::size_t next_ = 0;
  bool is_return_ = true;
  std::unique_ptr<CloudReader> cloud_;
  std::vector<CloudPoint> points_;
};

ScanFolder::ScanFolder(std::string folder, std::vector<std::string> names, std::string free)
    : folder_(std::move(folder)), names_(std::move(names)), free_(std::move(free)) {
  if (free_.empty()) return;
  const bool any = std::any_of(names_.begin(), names_.end(), [&](const std::string& scan) {
    std::error_code ignored;
    return fs::is_regular_file(fs::path(free_) / scan, ignored);
  });
  if (!any) throw InputError(fmt::format("{}: no cloud under a scan's name", free_));
}

double ScanFolder::time(std::size_t scan) const {
  const std::string stem = fs::path(names_[scan]).stem().string();
  double number = 0.0;
  const bool counts_scans =
      parse_number(stem, number) && number <= kNanosFrom && stem.find('.') == std::string::npos;
  if (counts_scans) return std::numeric_limits<double>::quiet_NaN();
  return seconds_in_name(names_[scan]).value_or(std::numeric_limits<double>::quiet_NaN());
}

std::string ScanFolder::path(std::size_t scan) const {
  return (fs::path(folder_) / names_[scan]).string();
}

bool ScanFolder::has_intensity() const {
  return !names_.empty() && open_cloud(path(0))->has_intensity();
}

std::unique_ptr<ScanReader> ScanFolder::open(const std::function<bool(std::size_t)>& chosen) const {
  return std::make_unique<ScanFolderReader>(*this, chosen);
}

std::vector<RecordedScan> read_scans(const ScanSource& source,
                                     std::size_t most,
                                     const Progress& progress) {
  std::vector<RecordedScan> scans(std::min(source.scan_count(), most));
  for (std::size_t i = 0; i < scans.size(); ++i) scans[i].time = source.time(i);
  ScanBatch batch;
  const auto reader = source.open();
  while (reader->read(batch) && batch.scan < scans.size()) {
    report(progress,
           "reading scans",
           static_cast<double>(batch.scan) / static_cast<double>(scans.size()));
    scans[batch.scan].time_unit = batch.time_unit;
    for (const RecordedPoint& point : batch.points) {
      if (!point.position.isZero(0.0)) scans[batch.scan].points.push_back(point);  // drivers: none
    }
  }
  for (RecordedScan& scan : scans) {
    double first = std::numeric_limits<double>::infinity();
    for (const RecordedPoint& point : scan.points) {
      if (std::isfinite(point.time)) first = std::min(first, point.time);
    }
    // times since 1970 would lose their last digits further on
    for (RecordedPoint& point : scan.points) point.time -= first;
  }
  return scans;
}

std::string settle_times(std::vector<RecordedScan>& scans,
                         const std::optional<TimeUnit>& given,
                         const std::string& name) {
  std::vector<double> intervals;
  std::vector<double> spans;
  for (std::size_t i = 0; i < scans.size(); ++i) {
    if (i > 0) intervals.push_back(scans[i].time - scans[i - 1].time);
    double span = 0.0;
    for (const RecordedPoint& point : scans[i].points) {
      if (std::isfinite(point.time)) span = std::max(span, point.time);
    }
    if (span > 0.0) spans.push_back(span);
  }
  std::erase_if(intervals, [](double seconds) { return !std::isfinite(seconds); });
  if (spans.empty() || intervals.empty()) return {};
  const auto median = [](std::vector<double>& values) {
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
  };
  const double assumed = scans.front().time_unit;
  const SettledUnit settled =
      settled_unit(median(spans) / assumed, assumed, median(intervals), given, name);
  if (settled.seconds == assumed) return settled.said;
  for (RecordedScan& scan : scans) {
    for (RecordedPoint& point : scan.points) point.time *= settled.seconds / assumed;
    scan.time_unit = settled.seconds;
  }
  return settled.said;
}

}  // namespace pointflight
