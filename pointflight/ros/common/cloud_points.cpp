#include "pointflight/ros/common/cloud_points.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <initializer_list>
#include <string>

#include "pointflight/core/input_error.hpp"

namespace pointflight {
namespace {

using Type = msg::PointField;

std::size_t size_of(std::uint8_t datatype) {
  switch (datatype) {
    case Type::INT8:
    case Type::UINT8:
      return 1;
    case Type::INT16:
    case Type::UINT16:
      return 2;
    case Type::INT32:
    case Type::UINT32:
    case Type::FLOAT32:
      return 4;
    case Type::FLOAT64:
      return 8;
    default:
      return 0;
  }
}

template <class T>
double number_at(const std::uint8_t* at) {
  T value{};
  std::memcpy(&value, at, sizeof value);
  return static_cast<double>(value);
}

double number_of(const std::uint8_t* point, const msg::PointField& field) {
  const std::uint8_t* at = point + field.offset;
  switch (field.datatype) {
    case Type::INT8:
      return number_at<std::int8_t>(at);
    case Type::UINT8:
      return number_at<std::uint8_t>(at);
    case Type::INT16:
      return number_at<std::int16_t>(at);
    case Type::UINT16:
      return number_at<std::uint16_t>(at);
    case Type::INT32:
      return number_at<std::int32_t>(at);
    case Type::UINT32:
      return number_at<std::uint32_t>(at);
    case Type::FLOAT32:
      return number_at<float>(at);
    default:
      return number_at<double>(at);
  }
}

/// The first of these names that the cloud has, nothing without any.
const msg::PointField* field_of(const msg::PointCloud2& cloud,
                                std::initializer_list<const char*> names) {
  for (const char* name : names) {
    for (const msg::PointField& field : cloud.point_fields) {
      if (field.name != name) continue;
      const std::size_t size = size_of(field.datatype);
      if (size == 0 || std::uint64_t{field.offset} + size > cloud.point_step) {
        throw InputError(fmt::format("its field '{}' does not lie within a point", name));
      }
      return &field;
    }
  }
  return nullptr;
}

/// s
double unit_of(double time, bool is_whole) {
  constexpr double kNanosFrom = 1e11;  // as seconds, the year 5138
  return is_whole || std::abs(time) > kNanosFrom ? 1e-9 : 1.0;
}

}  // namespace

CloudMessagePoints points_of(const msg::PointCloud2& cloud) {
  if (cloud.is_bigendian) throw InputError("its points are big-endian, which is not read");
  const std::uint64_t row = std::uint64_t{cloud.width} * cloud.point_step;
  const std::uint64_t stride = cloud.height > 1 ? cloud.row_step : row;
  CloudMessagePoints found;
  if (row == 0 || cloud.height == 0) return found;
  if (stride < row || stride > cloud.data.size() || row > cloud.data.size() ||
      cloud.height - 1 > (cloud.data.size() - row) / stride) {
    throw InputError(fmt::format("{} x {} points of {} bytes are not in its {} bytes",
                                 cloud.width,
                                 cloud.height,
                                 cloud.point_step,
                                 cloud.data.size()));
  }
  // fields may lie on each other, so that bytes alone do not bound what a point takes here
  constexpr std::uint64_t kMostPoints = 20'000'000;
  if (std::uint64_t{cloud.width} * cloud.height > kMostPoints) {
    throw InputError(fmt::format("{} x {} points, more than any scan has ({} million)",
                                 cloud.width,
                                 cloud.height,
                                 kMostPoints / 1'000'000));
  }
  const msg::PointField* const xyz[] = {
      field_of(cloud, {"x"}), field_of(cloud, {"y"}), field_of(cloud, {"z"})};
  if (std::find(std::begin(xyz), std::end(xyz), nullptr) != std::end(xyz)) {
    throw InputError("it has no fields x, y, z");
  }
  const auto* intensity = field_of(cloud, {"intensity", "reflectivity", "i"});
  const auto* time = field_of(cloud, {"t", "time", "timestamp", "time_stamp", "offset_time"});
  const auto* ring = field_of(cloud, {"ring", "line", "channel"});
  const bool is_whole =
      time != nullptr && time->datatype != Type::FLOAT32 && time->datatype != Type::FLOAT64;
  found.has_intensity = intensity != nullptr;
  found.points.reserve(std::size_t{cloud.width} * cloud.height);
  for (std::size_t r = 0; r < cloud.height; ++r) {
    for (std::size_t c = 0; c < cloud.width; ++c) {
      const std::uint8_t* at = cloud.data.data() + r * stride + c * cloud.point_step;
      RecordedPoint& point = found.points.emplace_back();
      for (int axis = 0; axis < 3; ++axis) point.position[axis] = number_of(at, *xyz[axis]);
      if (intensity != nullptr) point.intensity = static_cast<float>(number_of(at, *intensity));
      if (ring != nullptr) {
        const double number = number_of(at, *ring);
        point.ring = number >= 0.0 && number < 65536.0 ? static_cast<std::int32_t>(number) : -1;
      }
      if (time == nullptr) continue;
      const double number = number_of(at, *time);
      found.time_unit = unit_of(number, is_whole);
      point.time = number * found.time_unit;
    }
  }
  return found;
}

CloudMessagePoints points_of(const msg::CustomMsg& cloud) {
  CloudMessagePoints found;
  found.has_intensity = true;
  found.time_unit = 1e-9;
  found.points.reserve(cloud.points.size());
  for (const msg::CustomPoint& p : cloud.points) {
    const Vector3d position(
        static_cast<double>(p.x), static_cast<double>(p.y), static_cast<double>(p.z));
    found.points.push_back(
        {position, static_cast<float>(p.reflectivity), 1e-9 * p.offset_time, p.line});
  }
  return found;
}

}  // namespace pointflight
