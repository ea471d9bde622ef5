#include "pointflight/lidar/scan.hpp"

#include <fmt/format.h>

#include <cmath>
#include <cstddef>
#include <cstring>
#include <string_view>

#include "pointflight/core/argument.hpp"
#include "pointflight/core/constants.hpp"
#include "pointflight/core/input_error.hpp"
#include "pointflight/core/mapped_file.hpp"

namespace pointflight {
namespace {

constexpr std::size_t kFloats = 6;

/// A point's truth as files have it.
struct TruthRow {
  float true_range, incidence, depth, deskewed[3];
  std::uint32_t surfel, thing;
  std::uint16_t sub_ray, sub_rays;
  std::uint8_t assumed, kind;
};
constexpr std::size_t kTruthSize = 38;  // without what the compiler adds
static_assert(offsetof(TruthRow, kind) + 1 == kTruthSize);

/// Bytes per point.
constexpr std::size_t row_size(const ScanMarks& marks) {
  return kFloats * sizeof(float) + 2 * sizeof(std::uint16_t) + (marks.unknown ? 1 : 0) +
         (marks.echoes ? 1 : 0) + (marks.truth ? kTruthSize : 0);
}

TruthRow row_of(const PointTruth& truth) {
  return {truth.range,
          truth.incidence,
          truth.depth,
          {truth.deskewed.x(), truth.deskewed.y(), truth.deskewed.z()},
          truth.surfel,
          truth.part_of.thing,
          truth.sub_ray,
          truth.sub_rays,
          static_cast<std::uint8_t>(truth.is_assumed ? 1 : 0),
          truth.part_of.kind};
}

PointTruth truth_of(const TruthRow& row) {
  return {row.true_range,
          row.incidence,
          row.depth,
          Vector3f(row.deskewed),
          row.surfel,
          row.sub_ray,
          row.sub_rays,
          row.assumed != 0,
          {row.kind, row.thing}};
}

/// How far deskewing leaves a point off its beam at most, m: six deviations of half of what a whole
/// scan turns and shifts by.
float farthest_off(const DeskewingSettings& left, float range) {
  const auto turn = static_cast<float>(left.rotation_sigma_deg * kDegree);
  return 3.0f * (turn * range + static_cast<float>(left.translation_sigma)) * std::sqrt(3.0f);
}

}  // namespace

std::vector<PcdField> scan_fields(const ScanMarks& marks) {
  std::vector<PcdField> fields = {{"x", 'F', 4},
                                  {"y", 'F', 4},
                                  {"z", 'F', 4},
                                  {"intensity", 'F', 4},
                                  {"range", 'F', 4},
                                  {"time", 'F', 4},
                                  {"ring", 'U', 2},
                                  {"label", 'U', 2}};
  if (marks.unknown) fields.push_back({"unknown", 'U', 1});
  if (marks.echoes) fields.push_back({"echo", 'U', 1});
  if (!marks.truth) return fields;
  for (const char* name :
       {"true_range", "incidence", "depth", "deskewed_x", "deskewed_y", "deskewed_z"}) {
    fields.push_back({name, 'F', 4});
  }
  fields.push_back({"surfel", 'U', 4});
  fields.push_back({"thing", 'U', 4});
  fields.push_back({"sub_ray", 'U', 2});
  fields.push_back({"sub_rays", 'U', 2});
  fields.push_back({"assumed", 'U', 1});
  fields.push_back({"class", 'U', 1});
  return fields;
}

std::size_t scan_row_size(const ScanMarks& marks) {
  return row_size(marks);
}

void write_scan_rows(const Scan& scan, std::span<std::byte> rows) {
  const std::size_t row = row_size(scan.marks);
  require_argument(rows.size() == scan.points.size() * row,
                   "write_scan_rows: a row for each point is wanted");
  std::byte* at = rows.data();
  for (std::size_t i = 0; i < scan.points.size(); ++i) {
    const ScanPoint& point = scan.points[i];
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
    if (scan.marks.echoes) *mark++ = std::byte{point.echo};
    if (scan.marks.truth) {
      const TruthRow truth = row_of(scan.truth[i]);
      std::memcpy(mark, &truth, kTruthSize);
    }
    at += row;
  }
}

void write_scan_pcd(const std::string& path, const Scan& scan) {
  std::vector<std::byte> rows(scan.points.size() * row_size(scan.marks));
  write_scan_rows(scan, rows);
  write_pcd(OutputFile(path), scan_fields(scan.marks), scan.points.size(), rows);
}

void read_scan_points(const std::string& path,
                      std::span<const Beam> beams,
                      const DeskewingSettings& left,
                      Scan& scan) {
  const ScanMarks& marks = scan.marks;
  const std::size_t row = row_size(marks);
  std::string fields = "FIELDS";
  for (const PcdField& field : scan_fields(marks)) fields += " " + field.name;
  fields += "\n";
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
  scan.points.assign(size / row, {});
  scan.truth.assign(marks.truth ? size / row : 0, {});
  const char* at = text.data() + body + kBody.size();
  std::size_t beam = 0;
  for (std::size_t i = 0; i < scan.points.size(); ++i) {
    ScanPoint& point = scan.points[i];
    float values[kFloats];
    std::uint16_t integers[2];
    std::memcpy(values, at, sizeof values);
    std::memcpy(integers, at + sizeof values, sizeof integers);
    const char* mark = at + sizeof values + sizeof integers;
    if (marks.unknown) point.is_unknown = *mark++ != 0;
    if (marks.echoes) point.echo = static_cast<std::uint8_t>(*mark++);
    if (marks.truth) {
      TruthRow truth{};
      std::memcpy(&truth, mark, kTruthSize);
      scan.truth[i] = truth_of(truth);
    }
    at += row;
    point.position_sensor = {values[0], values[1], values[2]};
    point.intensity = values[3];
    point.range = values[4];
    point.ring = integers[0];
    point.label = integers[1];
    // in firing order: the next beam whose time and position are the point's
    const auto fits = [&](const Beam& b) {
      return static_cast<float>(to_seconds(b.time_offset)) == values[5] && b.ring == point.ring &&
             (b.origin_sensor + point.range * b.direction_sensor - point.position_sensor).norm() <=
                 1e-5f * (1.0f + point.range) + farthest_off(left, point.range);
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
}

}  // namespace pointflight
