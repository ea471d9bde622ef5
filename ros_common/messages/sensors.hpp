// What sensors measure: sensor_msgs and Livox' own cloud.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "ros_common/messages/geometry.hpp"

namespace pointflight::msg {

struct Imu {
  static constexpr TypeName kType{"sensor_msgs", "Imu"};
  Header header;
  Quaternion orientation;
  std::array<double, 9> orientation_covariance{};
  Vector3 angular_velocity;
  std::array<double, 9> angular_velocity_covariance{};
  Vector3 linear_acceleration;
  std::array<double, 9> linear_acceleration_covariance{};
  template <class M, class V>
  static void fields(M& m, V& v) {
    v("header", m.header);
    v("orientation", m.orientation);
    v("orientation_covariance", m.orientation_covariance);
    v("angular_velocity", m.angular_velocity);
    v("angular_velocity_covariance", m.angular_velocity_covariance);
    v("linear_acceleration", m.linear_acceleration);
    v("linear_acceleration_covariance", m.linear_acceleration_covariance);
  }
};

struct PointField {
  static constexpr TypeName kType{
      "sensor_msgs",
      "PointField",
      "sensor_msgs",
      "uint8 INT8    = 1\nuint8 UINT8   = 2\nuint8 INT16   = 3\nuint8 UINT16  = 4\n"
      "uint8 INT32   = 5\nuint8 UINT32  = 6\nuint8 FLOAT32 = 7\nuint8 FLOAT64 = 8\n"};
  enum Datatype : std::uint8_t {
    kInt8 = 1,
    kUint8,
    kInt16,
    kUint16,
    kInt32,
    kUint32,
    kFloat32,
    kFloat64
  };
  std::string name;
  std::uint32_t offset = 0;
  std::uint8_t datatype = 0;
  std::uint32_t count = 0;
  template <class M, class V>
  static void fields(M& m, V& v) {
    v("name", m.name);
    v("offset", m.offset);
    v("datatype", m.datatype);
    v("count", m.count);
  }
};

struct PointCloud2 {
  static constexpr TypeName kType{"sensor_msgs", "PointCloud2"};
  Header header;
  std::uint32_t height = 0, width = 0;
  std::vector<PointField> point_fields;  ///< `fields` on the wire.
  bool is_bigendian = false;
  std::uint32_t point_step = 0, row_step = 0;
  std::vector<std::uint8_t> data;
  bool is_dense = false;
  template <class M, class V>
  static void fields(M& m, V& v) {
    v("header", m.header);
    v("height", m.height);
    v("width", m.width);
    v("fields", m.point_fields);
    v("is_bigendian", m.is_bigendian);
    v("point_step", m.point_step);
    v("row_step", m.row_step);
    v("data", m.data);
    v("is_dense", m.is_dense);
  }
};

struct Image {
  static constexpr TypeName kType{"sensor_msgs", "Image"};
  Header header;
  std::uint32_t height = 0, width = 0;
  std::string encoding;
  std::uint8_t is_bigendian = 0;
  std::uint32_t step = 0;
  std::vector<std::uint8_t> data;
  template <class M, class V>
  static void fields(M& m, V& v) {
    v("header", m.header);
    v("height", m.height);
    v("width", m.width);
    v("encoding", m.encoding);
    v("is_bigendian", m.is_bigendian);
    v("step", m.step);
    v("data", m.data);
  }
};

struct RegionOfInterest {
  static constexpr TypeName kType{"sensor_msgs", "RegionOfInterest"};
  std::uint32_t x_offset = 0, y_offset = 0, height = 0, width = 0;
  bool do_rectify = false;
  template <class M, class V>
  static void fields(M& m, V& v) {
    v("x_offset", m.x_offset);
    v("y_offset", m.y_offset);
    v("height", m.height);
    v("width", m.width);
    v("do_rectify", m.do_rectify);
  }
};

struct CameraInfo {
  static constexpr TypeName kType{"sensor_msgs", "CameraInfo"};
  Header header;
  std::uint32_t height = 0, width = 0;
  std::string distortion_model;
  std::vector<double> d;
  std::array<double, 9> k{}, r{};
  std::array<double, 12> p{};
  std::uint32_t binning_x = 0, binning_y = 0;
  RegionOfInterest roi;
  template <class M, class V>
  static void fields(M& m, V& v) {
    constexpr bool kOld = V::kRos == 1;
    v("header", m.header);
    v("height", m.height);
    v("width", m.width);
    v("distortion_model", m.distortion_model);
    v(kOld ? "D" : "d", m.d);
    v(kOld ? "K" : "k", m.k);
    v(kOld ? "R" : "r", m.r);
    v(kOld ? "P" : "p", m.p);
    v("binning_x", m.binning_x);
    v("binning_y", m.binning_y);
    v("roi", m.roi);
  }
};

struct CompressedImage {
  static constexpr TypeName kType{"sensor_msgs", "CompressedImage"};
  Header header;
  std::string format;
  std::vector<std::uint8_t> data;
  template <class M, class V>
  static void fields(M& m, V& v) {
    v("header", m.header);
    v("format", m.format);
    v("data", m.data);
  }
};

struct Joy {
  static constexpr TypeName kType{"sensor_msgs", "Joy"};
  Header header;
  std::vector<float> axes;
  std::vector<std::int32_t> buttons;
  template <class M, class V>
  static void fields(M& m, V& v) {
    v("header", m.header);
    v("axes", m.axes);
    v("buttons", m.buttons);
  }
};

struct CustomPoint {
  static constexpr TypeName kType{"livox_ros_driver2", "CustomPoint"};
  std::uint32_t offset_time = 0;  ///< ns after `timebase`.
  float x = 0.0f, y = 0.0f, z = 0.0f;
  std::uint8_t reflectivity = 0, tag = 0, line = 0;
  template <class M, class V>
  static void fields(M& m, V& v) {
    v("offset_time", m.offset_time);
    v("x", m.x);
    v("y", m.y);
    v("z", m.z);
    v("reflectivity", m.reflectivity);
    v("tag", m.tag);
    v("line", m.line);
  }
};

/// Livox' own cloud; livox_ros_driver of ROS 1 has the same fields under its package's name.
struct CustomMsg {
  static constexpr TypeName kType{"livox_ros_driver2", "CustomMsg"};
  Header header;
  std::uint64_t timebase = 0;  ///< ns of the first point.
  std::uint32_t point_num = 0;
  std::uint8_t lidar_id = 0;
  std::array<std::uint8_t, 3> rsvd{};
  std::vector<CustomPoint> points;
  template <class M, class V>
  static void fields(M& m, V& v) {
    v("header", m.header);
    v("timebase", m.timebase);
    v("point_num", m.point_num);
    v("lidar_id", m.lidar_id);
    v("rsvd", m.rsvd);
    v("points", m.points);
  }
};

}  // namespace pointflight::msg
