#include "pointflight/fit/recorded_scans.hpp"

#include <algorithm>
#include <filesystem>

#include "pointflight/fit/survey_files.hpp"
#include "pointflight/io/byte_cursor.hpp"
#include "pointflight/io/cloud_reader.hpp"

namespace pointflight {
namespace {

/// Names are times in s with decimals, or in ns; other numbers are numbers.
double time_of_name(const std::string& name) {
  constexpr double kNanosFrom = 1e11;
  double time = 0.0;
  if (!parse_number(name, time)) return std::numeric_limits<double>::quiet_NaN();
  if (time > kNanosFrom) return 1e-9 * time;
  return name.find('.') != std::string::npos ? time : std::numeric_limits<double>::quiet_NaN();
}

}  // namespace

std::vector<RecordedScan> read_scans_of_folder(const std::string& folder,
                                               std::size_t most,
                                               const Progress& progress) {
  std::vector<std::string> names = scan_files_in(folder);
  names.resize(std::min(names.size(), most));
  std::vector<RecordedScan> scans;
  std::vector<CloudPoint> batch;
  for (std::size_t i = 0; i < names.size(); ++i) {
    report(progress, "reading scans", static_cast<double>(i) / static_cast<double>(names.size()));
    const std::filesystem::path path = std::filesystem::path(folder) / names[i];
    const auto cloud = open_cloud(path.string());
    RecordedScan& scan = scans.emplace_back();
    scan.time = time_of_name(path.stem().string());
    while (cloud->read(batch)) {
      const auto times = cloud->times();
      const auto rings = cloud->rings();
      for (std::size_t k = 0; k < batch.size(); ++k) {
        RecordedPoint& point = scan.points.emplace_back();
        point.position = batch[k].position.cast<float>();
        if (!times.empty()) point.time = times[k];
        if (!rings.empty()) point.ring = rings[k];
      }
    }
  }
  return scans;
}

}  // namespace pointflight
