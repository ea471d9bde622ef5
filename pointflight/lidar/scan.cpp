#include "pointflight/lidar/scan.hpp"

#include <fmt/format.h>

#include <cstring>
#include <string_view>

#include "pointflight/core/input_error.hpp"
#include "pointflight/core/mapped_file.hpp"
#include "pointflight/io/pcd_writer.hpp"

namespace pointflight {
namespace {

constexpr std::size_t kFloats = 6;

/// Bytes per point.
constexpr std::size_t row_size(const ScanMarks& marks) {
  return kFloats * sizeof(float) + 2 * sizeof(std::uint16_t) + (marks.unknown ? 1 : 0) +
         (marks.echoes ? 1 : 0);
}

}  // namespace

void write_scan_pcd(const std::string& path, const Scan& scan) {
  const std::size_t row = row_size(scan.marks);
  std::vector<std::byte> rows(scan.points.size() * row);
  std::byte* at = rows.data();
  for (const ScanPoint& point : scan.points) {
    const float values[kFloats] = {point.position_sensor.x(),
                                   point.position_sensor.y(),
                                   point.position_sensor.z(),
                                   point.intensity,
                                   point.range,
                                   static_cast<float>(to_seconds(point.time_offset))};
    std::memcpy(at, values, sizeof values);
    const std::uint16_t integers[2] = {point.ring, static_cast<std::uint16_t>(point.label)};
    std::memcpy(at + sizeof values, integers, sizeof integers);
    std::byte* mark = at + sizeof values + sizeof integers;
    if (scan.marks.unknown) *mark++ = std::byte{point.is_unknown};
    if (scan.marks.echoes) *mark = std::byte{point.echo};
    at += row;
  }
  std::vector<PcdField> columns = {{"x", 'F', 4},
                                   {"y", 'F', 4},
                                   {"z", 'F', 4},
                                   {"intensity", 'F', 4},
                                   {"range", 'F', 4},
                                   {"time", 'F', 4},
                                   {"ring", 'U', 2},
                                   {"label", 'U', 2}};
  if (scan.marks.unknown) columns.push_back({"unknown", 'U', 1});
  if (scan.marks.echoes) columns.push_back({"echo", 'U', 1});
  write_pcd(OutputFile(path), columns, scan.points.size(), rows);
}

std::vector<ScanPoint> read_scan_points(const std::string& path,
                                        std::span<const Beam> beams,
                                        const ScanMarks& marks) {
  const std::size_t row = row_size(marks);
  const std::string fields = fmt::format("FIELDS x y z intensity range time ring label{}{}\n",
                                         marks.unknown ? " unknown" : "",
                                         marks.echoes ? " echo" : "");
  constexpr std::string_view kBody = "DATA binary\n";
  const MappedFile file(path);
  const std::string_view text(reinterpret_cast<const char*>(file.bytes().data()),
                              file.bytes().size());
  const std::size_t body = text.find(kBody);
  const std::size_t size = body == std::string_view::npos ? 1 : text.size() - body - kBody.size();
  const bool own = text.substr(0, body).find(fields) != std::string_view::npos;
  if (!own || size % row != 0) {
    throw InputError(fmt::format("{}: is no scan of a run, or cut off", path));
  }
  std::vector<ScanPoint> points(size / row);
  const char* at = text.data() + body + kBody.size();
  std::size_t beam = 0;
  for (ScanPoint& point : points) {
    float values[kFloats];
    std::uint16_t integers[2];
    std::memcpy(values, at, sizeof values);
    std::memcpy(integers, at + sizeof values, sizeof integers);
    const char* mark = at + sizeof values + sizeof integers;
    if (marks.unknown) point.is_unknown = *mark++ != 0;
    if (marks.echoes) point.echo = static_cast<std::uint8_t>(*mark);
    at += row;
    point.position_sensor = {values[0], values[1], values[2]};
    point.intensity = values[3];
    point.range = values[4];
    point.ring = integers[0];
    point.label = integers[1];
    // in firing order: the next beam whose time and place are the point's
    const auto fits = [&](const Beam& b) {
      return static_cast<float>(to_seconds(b.time_offset)) == values[5] && b.ring == point.ring &&
             (b.origin_sensor + point.range * b.direction_sensor - point.position_sensor).norm() <=
                 1e-5f * (1.0f + point.range);
    };
    while (beam < beams.size() && !fits(beams[beam])) ++beam;
    if (beam == beams.size()) {
      throw InputError(
          fmt::format("{}: its points are not the sensor's; was its file changed?", path));
    }
    point.time_offset = beams[beam].time_offset;
    point.beam = static_cast<std::uint32_t>(beam);
    // without echoes each beam has one point
    if (!marks.echoes) ++beam;
  }
  return points;
}

}  // namespace pointflight
