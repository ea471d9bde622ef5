// What sensors measure: sensor_msgs and Livox' own cloud.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "ros_common/messages/geometry.hpp"

namespace pointflight::msg {

/// One sample: `imu_of`.
struct Imu {
  static constexpr TypeName kType{"sensor_msgs", "Imu"};
  Header header;           ///< The IMU's frame.
  Quaternion orientation;  ///< True attitude of its axes in the world.
  /// Row by row, rad^2; zeros, since it is the truth.
  std::array<double, 9> orientation_covariance{};
  Vector3 angular_velocity;  ///< rad/s, noise and bias included.
  /// Of a single sample, rad^2/s^2: density^2 times rate.
  std::array<double, 9> angular_velocity_covariance{};
  Vector3 linear_acceleration;  ///< m/s^2, but see `ImuCustoms`; noise and bias included.
  /// Of a single sample, in the unit above squared.
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

/// Where a value lies within a point.
struct PointField {
  static constexpr TypeName kType{
      "sensor_msgs",
      "PointField",
      "sensor_msgs",
      "uint8 INT8    = 1\nuint8 UINT8   = 2\nuint8 INT16   = 3\nuint8 UINT16  = 4\n"
      "uint8 INT32   = 5\nuint8 UINT32  = 6\nuint8 FLOAT32 = 7\nuint8 FLOAT64 = 8\n"};
  /// Values of `datatype`.
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
  std::string name;           ///< "x", "intensity", "ring", ...
  std::uint32_t offset = 0;   ///< Bytes from the point's first.
  std::uint8_t datatype = 0;  ///< `Datatype`
  std::uint32_t count = 0;    ///< Of values behind each other; 1 in all layouts here.
  template <class M, class V>
  static void fields(M& m, V& v) {
    v("name", m.name);
    v("offset", m.offset);
    v("datatype", m.datatype);
    v("count", m.count);
  }
};

/// A cloud in its sensor's own layout: `PointLayout`.
struct PointCloud2 {
  static constexpr TypeName kType{"sensor_msgs", "PointCloud2"};
  Header header;  ///< Frame of the points; stamp: `cloud_time`.
  /// 1 and the number of points: no grid.
  ///@{
  std::uint32_t height = 0, width = 0;
  ///@}
  std::vector<PointField> point_fields;  ///< `fields` on the wire.
  bool is_bigendian = false;             ///< Always false.
  /// Bytes per point; bytes in all.
  ///@{
  std::uint32_t point_step = 0, row_step = 0;
  ///@}
  std::vector<std::uint8_t> data;  ///< Point after point.
  bool is_dense = false;           ///< Always true: beams without a return have no point.
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

/// A picture: `depth_image_of`.
struct Image {
  static constexpr TypeName kType{"sensor_msgs", "Image"};
  Header header;  ///< The optical frame of a camera, else the sensor's.
  /// Pixels, rows first.
  ///@{
  std::uint32_t height = 0, width = 0;
  ///@}
  std::string encoding;            ///< "32FC1": a float a pixel.
  std::uint8_t is_bigendian = 0;   ///< Always 0.
  std::uint32_t step = 0;          ///< Bytes per row.
  std::vector<std::uint8_t> data;  ///< Row by row, the highest first.
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

/// A part of a picture; all zero: all of it.
struct RegionOfInterest {
  static constexpr TypeName kType{"sensor_msgs", "RegionOfInterest"};
  /// Pixels.
  ///@{
  std::uint32_t x_offset = 0, y_offset = 0, height = 0, width = 0;
  ///@}
  bool do_rectify = false;  ///< False for whole pictures.
  template <class M, class V>
  static void fields(M& m, V& v) {
    v("x_offset", m.x_offset);
    v("y_offset", m.y_offset);
    v("height", m.height);
    v("width", m.width);
    v("do_rectify", m.do_rectify);
  }
};

/// The camera matrix of a depth picture: `camera_info_of`.
struct CameraInfo {
  static constexpr TypeName kType{"sensor_msgs", "CameraInfo"};
  Header header;  ///< The same as the picture's.
  /// Pixels.
  ///@{
  std::uint32_t height = 0, width = 0;
  ///@}
  std::string distortion_model;  ///< "plumb_bob" with coefficients of zero: rays are straight.
  std::vector<double> d;         ///< Distortion.
  /// Camera matrix and rectification, row by row; `D`, `K`, `R`, `P` on ROS 1.
  ///@{
  std::array<double, 9> k{}, r{};
  ///@}
  std::array<double, 12> p{};  ///< Projection, three rows of four.
  /// 0 stands for 1: no binning.
  ///@{
  std::uint32_t binning_x = 0, binning_y = 0;
  ///@}
  RegionOfInterest roi;  ///< All of the picture.
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

/// Within a Marker of ROS 2 only; always empty here.
struct CompressedImage {
  static constexpr TypeName kType{"sensor_msgs", "CompressedImage"};
  Header header;                   ///< Not set.
  std::string format;              ///< "jpeg", "png", ...
  std::vector<std::uint8_t> data;  ///< The file's bytes.
  template <class M, class V>
  static void fields(M& m, V& v) {
    v("header", m.header);
    v("format", m.format);
    v("data", m.data);
  }
};

/// A gamepad, as joy_node sends it.
struct Joy {
  static constexpr TypeName kType{"sensor_msgs", "Joy"};
  Header header;                      ///< Not looked at.
  std::vector<float> axes;            ///< -1 to 1: 0 turns left, 1 climbs, 3 goes left, 4 ahead.
  std::vector<std::int32_t> buttons;  ///< 0 or 1: button 0 takes off, 1 lands, 2 hovers.
  template <class M, class V>
  static void fields(M& m, V& v) {
    v("header", m.header);
    v("axes", m.axes);
    v("buttons", m.buttons);
  }
};

/// One return as Livox' drivers send it.
struct CustomPoint {
  static constexpr TypeName kType{"livox_ros_driver2", "CustomPoint"};
  std::uint32_t offset_time = 0;  ///< ns after `timebase`.
  /// m, sensor frame at the point's own time.
  ///@{
  float x = 0.0f, y = 0.0f, z = 0.0f;
  ///@}
  /// Intensity up to 255; 0x10, a single return of good confidence; ring.
  ///@{
  std::uint8_t reflectivity = 0, tag = 0, line = 0;
  ///@}
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
  Header header;                       ///< Stamp: that of the first point.
  std::uint64_t timebase = 0;          ///< ns of the first point.
  std::uint32_t point_num = 0;         ///< As many as `points`.
  std::uint8_t lidar_id = 0;           ///< Number of the LiDAR on its vehicle.
  std::array<std::uint8_t, 3> rsvd{};  ///< Reserved.
  std::vector<CustomPoint> points;     ///< In firing order.
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
