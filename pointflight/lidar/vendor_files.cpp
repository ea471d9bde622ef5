#include "pointflight/lidar/vendor_files.hpp"

#include <fmt/format.h>

#include <array>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <vector>

#include "pointflight/core/input_error.hpp"
#include "pointflight/core/mapped_file.hpp"
#include "pointflight/io/csv_table.hpp"

namespace pointflight {
namespace {

using nlohmann::json;

constexpr double kMillimetre = 1e-3;
constexpr double kFirstGeneration = 12.5e-3;  // m: an OS1 whose beams leave nearer to its axis
constexpr double kLivoxTable = 4.0;           // s

/// The members of Ouster's metadata, in whichever of its two layouts.
class Metadata {
 public:
  Metadata(std::string_view text, const std::string& path) : path_(path) {
    root_ = json::parse(text.begin(), text.end(), nullptr, false);
    if (root_.is_discarded() || !root_.is_object()) {
      fail("", "this is no JSON object; Ouster's metadata of a unit is wanted");
    }
  }

  /// The first of the names that is a member, of the root or of a section; else null.
  [[nodiscard]] const json* find(std::string_view name) const {
    if (const auto member = root_.find(name); member != root_.end()) return &*member;
    for (const char* section : {"beam_intrinsics",
                                "lidar_intrinsics",
                                "lidar_data_format",
                                "data_format",
                                "sensor_info",
                                "config_params"}) {
      const auto inner = root_.find(section);
      if (inner == root_.end() || !inner->is_object()) continue;
      if (const auto member = inner->find(name); member != inner->end()) return &*member;
    }
    return nullptr;
  }

  [[nodiscard]] std::vector<double> numbers(std::string_view name) const {
    const json* member = find(name);
    if (member == nullptr) return {};
    if (!member->is_array()) fail(name, "a list of numbers is wanted");
    std::vector<double> values;
    for (const json& value : *member) {
      // rows of rows, as some firmware has it
      if (value.is_array()) {
        for (const json& inner : value) values.push_back(number(name, inner));
      } else {
        values.push_back(number(name, value));
      }
    }
    return values;
  }

  [[nodiscard]] std::optional<double> find_number(std::string_view name) const {
    const json* member = find(name);
    return member == nullptr ? std::nullopt : std::optional(number(name, *member));
  }

  [[nodiscard]] std::string text(std::string_view name) const {
    const json* member = find(name);
    return member != nullptr && member->is_string() ? member->get<std::string>() : std::string();
  }

  [[noreturn]] void fail(std::string_view name, const std::string& what) const {
    throw InputError(fmt::format("{}: {}{}{}", path_, name, name.empty() ? "" : ": ", what));
  }

 private:
  [[nodiscard]] double number(std::string_view name, const json& value) const {
    if (!value.is_number() || !std::isfinite(value.get<double>())) {
      fail(name, "a number is wanted");
    }
    return value.get<double>();
  }

  std::string path_;
  json root_;
};

/// Columns and turns per second of a mode, "1024x10".
std::pair<std::int64_t, double> mode_of(const Metadata& metadata) {
  const std::string mode = metadata.text("lidar_mode");
  std::int64_t columns = 0;
  std::int64_t turns = 0;
  const std::size_t cross = mode.find('x');
  if (cross != std::string::npos) {
    const char* begin = mode.data();
    const auto first = std::from_chars(begin, begin + cross, columns);
    const auto second = std::from_chars(begin + cross + 1, begin + mode.size(), turns);
    const bool is_read = first.ec == std::errc() && first.ptr == begin + cross &&
                         second.ec == std::errc() && second.ptr == begin + mode.size();
    if (is_read && columns > 0 && turns > 0 && columns <= 65536 && turns <= 1000) {
      return {columns, static_cast<double>(turns)};
    }
  }
  metadata.fail("lidar_mode", fmt::format("'{}' is no mode such as 1024x10", mode));
}

/// The shipped sensor whose range, noise and optics a unit has.
std::string base_of(const Metadata& metadata, const std::string& line, double radius) {
  if (line.starts_with("OS-0")) return "os0_128";
  if (line.starts_with("OS-1")) return radius < kFirstGeneration ? "os1_64" : "os1_128";
  if (line.starts_with("OS-2")) return "os2_128";
  if (line.starts_with("OS-DOME")) return "os0_128";
  metadata.fail("prod_line", fmt::format("'{}' is none of OS-0, OS-1, OS-2 and OS-DOME", line));
}

std::string_view text_of(const MappedFile& file) {
  const auto bytes = file.bytes();
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

}  // namespace

LidarSettings parse_ouster_metadata(std::string_view text, const std::string& path) {
  const Metadata metadata(text, path);
  const std::vector<double> altitudes = metadata.numbers("beam_altitude_angles");
  const std::vector<double> azimuths = metadata.numbers("beam_azimuth_angles");
  if (altitudes.empty() || altitudes.size() != azimuths.size()) {
    metadata.fail("beam_altitude_angles",
                  fmt::format("{} of these and {} beam_azimuth_angles; one of each per beam is "
                              "wanted, as in Ouster's metadata of a unit",
                              altitudes.size(),
                              azimuths.size()));
  }
  double radius = 0.0;
  double up = 0.0;  // of the beams' origin in the LiDAR's frame
  const std::vector<double> from_beam = metadata.numbers("beam_to_lidar_transform");
  if (from_beam.size() == 16) {
    radius = from_beam[3] * kMillimetre;
    up = from_beam[11] * kMillimetre;
  } else if (const auto origin = metadata.find_number("lidar_origin_to_beam_origin_mm")) {
    radius = *origin * kMillimetre;
  }
  const std::vector<double> to_sensor = metadata.numbers("lidar_to_sensor_transform");
  const auto [columns, turns] = mode_of(metadata);
  const std::string line = metadata.text("prod_line");
  const std::string base = base_of(metadata, line, radius);
  LidarSettings settings = load_lidar(base);
  settings.source = fmt::format("beams, columns, origin: {}; range, noise, optics: as {}",
                                std::filesystem::path(path).filename().string(),
                                base);
  settings.title = fmt::format("Ouster {} (unit's own beams, {} columns)", line, columns);
  settings.grounds.pattern = Ground::kSheet;
  settings.path = path;
  settings.lines.clear();
  settings.rate = turns;
  RingsSettings rings;
  rings.convention = RingConvention::kOuster;
  rings.elevations_deg = altitudes;
  rings.azimuth_offsets_deg = azimuths;
  rings.columns = columns;
  rings.beam_origin_radius = radius;
  rings.origin_z = up + (to_sensor.size() == 16 ? to_sensor[11] * kMillimetre : 0.0);
  settings.rings = rings;
  check(settings);
  return settings;
}

LidarSettings load_ouster_metadata(const std::string& path) {
  const MappedFile file(path);
  return parse_ouster_metadata(text_of(file), path);
}

LidarSettings load_livox_table(const std::string& path) {
  struct Known {
    double points_per_second;
    const char* base;
    std::int64_t lines;
  };
  constexpr std::array<Known, 3> kKnown = {
      {{200000.0, "mid360", 4}, {240000.0, "avia", 6}, {100000.0, "mid40", 1}}};
  const CsvTable table(path);
  const double points_per_second = static_cast<double>(table.rows()) / kLivoxTable;
  for (const Known& known : kKnown) {
    if (known.points_per_second != points_per_second) continue;
    LidarSettings settings = load_lidar(known.base);
    const std::string name = std::filesystem::path(path).filename().string();
    settings.title = fmt::format("directions of {}", name);
    settings.source = fmt::format("directions: {}; range, noise, optics: as {}", name, known.base);
    settings.grounds.pattern = Ground::kSheet;
    settings.path = path;
    settings.lines.clear();
    settings.pattern = ScanPattern::kCsv;
    settings.csv = {name, points_per_second, known.lines};
    check(settings);
    return settings;
  }
  throw InputError(fmt::format(
      "{}: {} rows are no 4 s of a Livox (800,000 of a Mid-360, 960,000 of an Avia, 400,000 of a "
      "Mid-40 or Mid-70); write a sensor file with pattern: csv that says the points per second",
      path,
      table.rows()));
}

}  // namespace pointflight
