#include <fmt/format.h>

#include <cmath>
#include <filesystem>

#include "pointflight/core/constants.hpp"
#include "pointflight/core/input_error.hpp"
#include "pointflight/core/resources.hpp"
#include "pointflight/io/csv_table.hpp"
#include "pointflight/lidar/lidar_settings.hpp"
#include "pointflight/lidar/patterns/patterns.hpp"

namespace pointflight {
namespace {

/// A user's table of directions, replayed in a loop at a fixed rate.
class CsvPattern : public BeamPattern {
 public:
  explicit CsvPattern(const LidarSettings& settings)
      : lines_(static_cast<std::uint64_t>(settings.csv.lines)),
        train_(settings.csv.points_per_second, Duration{0}, settings.rate) {
    const std::string folder = std::filesystem::path(settings.path).parent_path().string();
    const std::string path = resolve_path(settings.csv.file, folder);
    const CsvTable table = settings.at("csv.file", [&] { return CsvTable(path); });
    const int azimuth = table.require("azimuth");
    const int zenith = table.find("zenith");
    const int elevation = zenith < 0 ? table.require("elevation") : -1;
    for (std::size_t row = 0; row < table.rows(); ++row) {
      const double up = zenith < 0 ? table.at(row, elevation) : 90.0 - table.at(row, zenith);
      const double around = table.at(row, azimuth);
      constexpr double kRounded = 1e-3;  // deg
      if (!(std::abs(around) <= 720.0) || !(std::abs(up) <= 90.0 + kRounded)) {
        throw InputError(fmt::format("{}: ({}, {}) is no azimuth and elevation in degrees",
                                     table.location(row),
                                     around,
                                     up));
      }
      const Vector3d d = direction_of(around * kDegree, up * kDegree);
      directions_.push_back(d.cast<float>());
    }
  }

  [[nodiscard]] std::vector<Beam> beams(std::uint64_t scan_index,
                                        const Executor& /*executor*/) const override {
    const ShotTrain::Range range = train_.in_scan(scan_index);
    std::vector<Beam> beams;
    beams.reserve(static_cast<std::size_t>(range.end - range.begin));
    for (std::int64_t n = range.begin; n < range.end; ++n) {
      const std::uint64_t row = static_cast<std::uint64_t>(n) % directions_.size();
      beams.push_back({Vector3f::Zero(),
                       directions_[row],
                       train_.shots.at(n) - range.scan_start,
                       static_cast<std::uint16_t>(row % lines_)});
    }
    return beams;
  }

 private:
  std::uint64_t lines_;
  ShotTrain train_;
  std::vector<Vector3f> directions_;
};

}  // namespace

std::unique_ptr<BeamPattern> make_csv_pattern(const LidarSettings& settings) {
  return std::make_unique<CsvPattern>(settings);
}

}  // namespace pointflight
