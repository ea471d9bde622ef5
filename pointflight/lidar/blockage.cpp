#include "pointflight/lidar/blockage.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "pointflight/core/constants.hpp"
#include "pointflight/core/input_error.hpp"
#include "pointflight/core/math.hpp"
#include "pointflight/core/random.hpp"
#include "pointflight/io/csv_table.hpp"

namespace pointflight {
namespace {

constexpr double kSway = 1.0;  // s between draws of the level

std::size_t row_of(double elevation) {
  return static_cast<std::size_t>(std::clamp(std::floor(elevation) + 90.0, 0.0, 179.0));
}

bool is_within(const BlockedSector& s, double azimuth, double elevation) {
  if (elevation < s.elevation_from || elevation > s.elevation_to) return false;
  if (s.azimuth_from <= s.azimuth_to) return azimuth >= s.azimuth_from && azimuth <= s.azimuth_to;
  return azimuth >= s.azimuth_from || azimuth <= s.azimuth_to;
}

std::vector<BlockedSector> sectors_in(const CsvTable& table) {
  const int azimuth_from = table.require("azimuth_from_deg");
  const int azimuth_to = table.require("azimuth_to_deg");
  const int elevation_from = table.require("elevation_from_deg");
  const int elevation_to = table.require("elevation_to_deg");
  const int share = table.find("share");
  std::vector<BlockedSector> sectors;
  for (std::size_t row = 0; row < table.rows(); ++row) {
    const auto number = [&](int column, const char* name, double least, double most) {
      const double value = table.at(row, column);
      if (value >= least && value <= most) return value;
      throw InputError(fmt::format(
          "{}: {} {} is not between {} and {}", table.location(row), name, value, least, most));
    };
    BlockedSector sector;
    sector.azimuth_from = number(azimuth_from, "azimuth_from_deg", -180.0, 180.0);
    sector.azimuth_to = number(azimuth_to, "azimuth_to_deg", -180.0, 180.0);
    sector.elevation_from = number(elevation_from, "elevation_from_deg", -90.0, 90.0);
    sector.elevation_to = number(elevation_to, "elevation_to_deg", -90.0, 90.0);
    if (share >= 0) sector.share = number(share, "share", 0.0, 1.0);
    if (sector.elevation_from >= sector.elevation_to) {
      throw InputError(fmt::format("{}: elevation_from_deg {} is not below elevation_to_deg {}",
                                   table.location(row),
                                   sector.elevation_from,
                                   sector.elevation_to));
    }
    sectors.push_back(sector);
  }
  return sectors;
}

}  // namespace

Blockage::Blockage(const std::vector<BlockedSector>& sectors) : sectors_(sectors.size()) {
  for (const BlockedSector& sector : sectors) {
    const std::size_t last = row_of(sector.elevation_to);
    for (std::size_t row = row_of(sector.elevation_from); row <= last; ++row) {
      of_row_[row].push_back(sector);
    }
  }
}

double Blockage::share(const Vector3f& direction_sensor) const {
  const Vector3d d = direction_sensor.cast<double>();
  const double elevation = math::asin(std::clamp(d.z(), -1.0, 1.0)) / kDegree;
  const std::vector<BlockedSector>& row = of_row_[row_of(elevation)];
  if (row.empty()) return 0.0;
  const double azimuth = math::atan2(d.y(), d.x()) / kDegree;
  double share = 0.0;
  for (const BlockedSector& sector : row) {
    if (sector.share > share && is_within(sector, azimuth, elevation)) share = sector.share;
  }
  return share;
}

double blockage_level(std::uint64_t seed, std::uint32_t sensor, SimTime time) {
  const RandomStream random(seed, StreamId::kLidarBlockage, sensor);
  return math::normal_probability(
      random.moving_normal(to_seconds(time.time_since_epoch()) / kSway));
}

std::vector<BlockedSector> read_blocked_sectors(const std::string& path) {
  return sectors_in(CsvTable(path));
}

std::vector<BlockedSector> parse_blocked_sectors(std::string_view text, const std::string& path) {
  return sectors_in(CsvTable(text, path));
}

std::vector<BlockedSector> read_blocked_sectors(const LidarSettings& settings) {
  if (settings.blocked.empty()) return {};
  LidarSettings resolved = settings;
  return settings.at("blocked", [&] {
    static_cast<void>(tables_of(resolved));
    return read_blocked_sectors(resolved.blocked);
  });
}

std::string blocked_sectors_csv(const std::vector<BlockedSector>& sectors) {
  std::string text =
      "# Directions in the sensor's frame (x forward, y left, z up) in which its carrier is in the "
      "way,\n# and for what share of the time.\n"
      "azimuth_from_deg,azimuth_to_deg,elevation_from_deg,elevation_to_deg,share\n";
  for (const BlockedSector& s : sectors) {
    text += fmt::format("{:g},{:g},{:g},{:g},{:g}\n",
                        s.azimuth_from,
                        s.azimuth_to,
                        s.elevation_from,
                        s.elevation_to,
                        s.share);
  }
  return text;
}

}  // namespace pointflight
