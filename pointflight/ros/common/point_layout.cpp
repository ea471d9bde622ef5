#include "pointflight/ros/common/point_layout.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "pointflight/core/input_error.hpp"

namespace pointflight {
namespace {

using Source = PointLayout::Source;
using Field = PointLayout::Field;
using Type = msg::PointField;

/// Of a Livox point: bits 4 and 5 number its beam's returns, the first one 1.
constexpr std::uint8_t tag_of(std::uint8_t echo) {
  return static_cast<std::uint8_t>((echo + 1) << 4);
}

constexpr Field kX{"x", 0, Type::FLOAT32, Source::kX};
constexpr Field kY{"y", 4, Type::FLOAT32, Source::kY};
constexpr Field kZ{"z", 8, Type::FLOAT32, Source::kZ};

// livox_ros_driver2, format 0
constexpr Field kLivox[] = {kX,
                            kY,
                            kZ,
                            {"intensity", 12, Type::FLOAT32, Source::kIntensity},
                            {"tag", 16, Type::UINT8, Source::kTag},
                            {"line", 17, Type::UINT8, Source::kRing},
                            {"timestamp", 18, Type::FLOAT64, Source::kAbsoluteNanos}};
// velodyne_pointcloud, packed and as PCL's structs lie in memory
constexpr Field kVelodyne[] = {kX,
                               kY,
                               kZ,
                               {"intensity", 12, Type::FLOAT32, Source::kIntensity},
                               {"ring", 16, Type::UINT16, Source::kRing},
                               {"time", 18, Type::FLOAT32, Source::kSecondsAfter}};
constexpr Field kVelodynePadded[] = {kX,
                                     kY,
                                     kZ,
                                     {"intensity", 16, Type::FLOAT32, Source::kIntensity},
                                     {"ring", 20, Type::UINT16, Source::kRing},
                                     {"time", 24, Type::FLOAT32, Source::kSecondsAfter}};
// ouster_ros of the time of FAST-LIO and LIO-SAM: ring has one byte
constexpr Field kOuster[] = {kX,
                             kY,
                             kZ,
                             {"intensity", 16, Type::FLOAT32, Source::kIntensity},
                             {"t", 20, Type::UINT32, Source::kNanosAfter},
                             {"reflectivity", 24, Type::UINT16, Source::kIntensity},
                             {"ring", 26, Type::UINT8, Source::kRing},
                             {"ambient", 28, Type::UINT16, Source::kZero},
                             {"range", 32, Type::UINT32, Source::kRangeMillimetres}};
constexpr Field kHesai[] = {kX,
                            kY,
                            kZ,
                            {"intensity", 16, Type::FLOAT32, Source::kIntensity},
                            {"timestamp", 24, Type::FLOAT64, Source::kAbsoluteSeconds},
                            {"ring", 32, Type::UINT16, Source::kRing}};
constexpr Field kXyzi[] = {kX, kY, kZ, {"intensity", 12, Type::FLOAT32, Source::kIntensity}};
constexpr Field kXyziPadded[] = {kX, kY, kZ, {"intensity", 16, Type::FLOAT32, Source::kIntensity}};
constexpr Field kXyzit[] = {kX,
                            kY,
                            kZ,
                            {"intensity", 12, Type::FLOAT32, Source::kIntensity},
                            {"t", 16, Type::UINT32, Source::kNanosAfter},
                            {"ring", 20, Type::UINT16, Source::kRing}};
// what a planner wants to know of a simulated point and no driver says
constexpr Field kXyzitUnknown[] = {kX,
                                   kY,
                                   kZ,
                                   {"intensity", 12, Type::FLOAT32, Source::kIntensity},
                                   {"t", 16, Type::UINT32, Source::kNanosAfter},
                                   {"ring", 20, Type::UINT16, Source::kRing},
                                   {"unknown", 22, Type::UINT8, Source::kUnknown}};
constexpr Field kXyziUnknown[] = {kX,
                                  kY,
                                  kZ,
                                  {"intensity", 12, Type::FLOAT32, Source::kIntensity},
                                  {"unknown", 16, Type::UINT8, Source::kUnknown}};
constexpr Field kXyz[] = {kX, kY, kZ};
// FAST_LIO_ROS2 (Ericsii), lidar_type 4
constexpr Field kReflectivity[] = {kX,
                                   kY,
                                   kZ,
                                   {"reflectivity", 12, Type::FLOAT32, Source::kIntensity},
                                   {"tag", 16, Type::UINT8, Source::kTag},
                                   {"line", 17, Type::UINT8, Source::kRing}};

constexpr PointLayout kLayouts[] = {
    {"livox", "livox_ros_driver2's PointCloud2", 26, kLivox, true},
    {"velodyne", "velodyne_pointcloud", 22, kVelodyne, true},
    {"velodyne_padded", "the same as PCL's structs lie in memory", 32, kVelodynePadded, true},
    {"ouster", "ouster_ros with a ring of one byte", 48, kOuster, true},
    {"hesai", "hesai_ros_driver", 48, kHesai, true},
    {"xyzit", "x, y, z, intensity, t in ns, ring", 22, kXyzit, true},
    {"xyzi", "x, y, z, intensity", 16, kXyzi, false},
    {"xyzi_padded", "the same as PCL's PointXYZI (MARSIM)", 32, kXyziPadded, false},
    {"xyz", "x, y, z", 12, kXyz, false},
    {"xyz_padded", "the same as PCL's PointXYZ (maps of MARSIM)", 16, kXyz, false},
    {"xyzit_unknown", "xyzit and 1 where no survey saw what lies before", 23, kXyzitUnknown, true},
    {"xyzi_unknown", "xyzi and the same", 17, kXyziUnknown, false},
    {"reflectivity", "x, y, z, reflectivity, tag, line (FAST_LIO_ROS2)", 18, kReflectivity, false},
};

/// One point's values before they become bytes.
struct Values {
  Vector3f position;
  float intensity = 0.0f;
  std::uint16_t ring = 0;
  float range = 0.0f;
  bool is_unknown = false;
  std::uint8_t echo = 0;
  Duration after{0};          ///< After the stamp.
  std::int64_t absolute = 0;  ///< ns since the epoch.
};

template <class T>
void put(std::uint8_t* at, T value) {
  std::memcpy(at, &value, sizeof(T));
}

/// A number as the type that the field has, clamped to what it can hold.
void put_as(std::uint8_t* at, std::uint8_t type, double value) {
  const auto whole = [&](double most) { return std::clamp(std::nearbyint(value), 0.0, most); };
  switch (type) {
    case Type::FLOAT32:
      put(at, static_cast<float>(value));
      break;
    case Type::FLOAT64:
      put(at, value);
      break;
    case Type::UINT8:
      put(at, static_cast<std::uint8_t>(whole(255.0)));
      break;
    case Type::UINT16:
      put(at, static_cast<std::uint16_t>(whole(65535.0)));
      break;
    default:
      put(at, static_cast<std::uint32_t>(whole(4294967295.0)));
      break;
  }
}

double number_for(Source source, const Values& v) {
  switch (source) {
    case Source::kX:
      return static_cast<double>(v.position.x());
    case Source::kY:
      return static_cast<double>(v.position.y());
    case Source::kZ:
      return static_cast<double>(v.position.z());
    case Source::kIntensity:
      return static_cast<double>(v.intensity);
    case Source::kRing:
      return v.ring;
    case Source::kTag:
      return tag_of(v.echo);
    case Source::kSecondsAfter:
      return to_seconds(v.after);
    case Source::kNanosAfter:
      return static_cast<double>(v.after.count());
    case Source::kAbsoluteNanos:
      return static_cast<double>(v.absolute);
    case Source::kAbsoluteSeconds:
      return static_cast<double>(v.absolute) * 1e-9;
    case Source::kRangeMillimetres:
      return 1e3 * static_cast<double>(v.range);
    case Source::kUnknown:
      return v.is_unknown ? 1.0 : 0.0;
    case Source::kZero:
      return 0.0;
  }
  return 0.0;
}

/// A cloud without points yet.
msg::PointCloud2 empty_cloud(const PointLayout& layout, std::size_t points) {
  msg::PointCloud2 cloud;
  cloud.height = 1;
  cloud.width = static_cast<std::uint32_t>(points);
  for (const Field& field : layout.fields) {
    cloud.point_fields.push_back({field.name, field.offset, field.type, 1});
  }
  cloud.point_step = layout.step;
  cloud.row_step = layout.step * cloud.width;
  cloud.data.resize(points * layout.step);
  cloud.is_dense = true;
  return cloud;
}

void write_point(std::uint8_t* at, const PointLayout& layout, const Values& values) {
  for (const Field& field : layout.fields) {
    put_as(at + field.offset, field.type, number_for(field.source, values));
  }
}

Values values_at(SimTime fired, SimTime stamp, Duration epoch) {
  Values values;
  values.after = fired - stamp;
  values.absolute = (fired.time_since_epoch() + epoch).count();
  return values;
}

/// An organised cloud in which nothing has come back.
msg::PointCloud2 blank_grid(const Scan& scan,
                            const PointLayout& layout,
                            const CloudGrid& grid,
                            SimTime stamp,
                            Duration epoch) {
  const std::size_t columns = grid.cells_of(scan).columns;
  msg::PointCloud2 cloud = empty_cloud(layout, grid.rows() * columns);
  cloud.height = static_cast<std::uint32_t>(grid.rows());
  cloud.width = static_cast<std::uint32_t>(columns);
  cloud.row_step = layout.step * cloud.width;
  cloud.is_dense = false;
  for (std::size_t column = 0; column < columns; ++column) {
    const auto share = static_cast<double>(column) / static_cast<double>(columns);
    const SimTime fired = scan.start + from_seconds(share * to_seconds(scan.end - scan.start));
    Values values = values_at(fired, stamp, epoch);
    values.position.setConstant(std::numeric_limits<float>::quiet_NaN());
    for (std::size_t row = 0; row < grid.rows(); ++row) {
      values.ring = grid.ring_of(row);
      write_point(cloud.data.data() + (row * columns + column) * layout.step, layout, values);
    }
  }
  return cloud;
}

std::uint8_t as_byte(float value) {
  return static_cast<std::uint8_t>(std::clamp(std::nearbyint(value), 0.0f, 255.0f));
}

}  // namespace

std::span<const PointLayout> point_layouts() {
  return kLayouts;
}

const PointLayout& point_layout(std::string_view name) {
  std::vector<std::string> names;
  for (const PointLayout& layout : kLayouts) {
    if (name == layout.name) return layout;
    names.emplace_back(layout.name);
  }
  throw InputError(
      fmt::format("point layout '{}' is unknown; one of: {}", name, fmt::join(names, ", ")));
}

msg::Time stamp_of(SimTime time, Duration epoch) {
  const std::int64_t ns = (time.time_since_epoch() + epoch).count();
  constexpr std::int64_t kSecond = 1'000'000'000;
  return {static_cast<std::int32_t>(ns / kSecond), static_cast<std::uint32_t>(ns % kSecond)};
}

SimTime cloud_time(const Scan& scan, bool timed) {
  if (!timed) return scan.middle;
  return scan.points.empty() ? scan.start : scan.start + scan.points.front().time_offset;
}

msg::PointCloud2 cloud_of(const Scan& scan,
                          const PointLayout& layout,
                          const std::string& frame,
                          Duration epoch,
                          std::span<const Vector3f> positions,
                          float plain,
                          const CloudGrid* grid) {
  // of an organised one: cells without a return have times too
  const SimTime time =
      grid != nullptr && layout.timed ? scan.start : cloud_time(scan, layout.timed);
  msg::PointCloud2 cloud = grid == nullptr ? empty_cloud(layout, scan.points.size())
                                           : blank_grid(scan, layout, *grid, time, epoch);
  const CloudGrid::Cells cells = grid == nullptr ? CloudGrid::Cells{} : grid->cells_of(scan);
  cloud.header.stamp = stamp_of(time, epoch);
  cloud.header.frame_id = frame;
  for (std::size_t i = 0; i < scan.points.size(); ++i) {
    const ScanPoint& point = scan.points[i];
    if (grid != nullptr && point.echo > 0) continue;
    const std::size_t cell =
        grid == nullptr ? i : grid->row_of(point) * cloud.width + grid->column_of(point, cells);
    Values values = values_at(scan.start + point.time_offset, time, epoch);
    values.position = positions.empty() ? point.position_sensor : positions[i];
    values.intensity = point.intensity == 0.0f ? plain : point.intensity;
    values.ring = point.ring;
    values.range = point.range;
    values.is_unknown = point.is_unknown;
    values.echo = point.echo;
    write_point(cloud.data.data() + cell * layout.step, layout, values);
  }
  return cloud;
}

msg::CustomMsg custom_cloud_of(const Scan& scan,
                               const std::string& frame,
                               Duration epoch,
                               float plain) {
  msg::CustomMsg cloud;
  const SimTime time = cloud_time(scan, true);
  cloud.header.stamp = stamp_of(time, epoch);
  cloud.header.frame_id = frame;
  cloud.timebase = static_cast<std::uint64_t>((time.time_since_epoch() + epoch).count());
  cloud.point_num = static_cast<std::uint32_t>(scan.points.size());
  cloud.lidar_id = static_cast<std::uint8_t>(scan.sensor);
  cloud.points.reserve(scan.points.size());
  for (const ScanPoint& point : scan.points) {
    const Duration after = scan.start + point.time_offset - time;
    cloud.points.push_back({static_cast<std::uint32_t>(after.count()),
                            point.position_sensor.x(),
                            point.position_sensor.y(),
                            point.position_sensor.z(),
                            as_byte(point.intensity == 0.0f ? plain : point.intensity),
                            tag_of(point.echo),
                            static_cast<std::uint8_t>(point.ring)});
  }
  return cloud;
}

msg::PointCloud2 cloud_of_points(std::span<const Vector3f> points,
                                 std::span<const float> intensities,
                                 const PointLayout& layout) {
  msg::PointCloud2 cloud = empty_cloud(layout, points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    Values values;
    values.position = points[i];
    values.intensity = intensities.empty() ? 0.0f : intensities[i];
    write_point(cloud.data.data() + i * layout.step, layout, values);
  }
  return cloud;
}

}  // namespace pointflight
