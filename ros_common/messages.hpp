// The messages that ROS 1 and ROS 2 share: a struct and a table of its fields each. Codecs
// (codec.hpp) and definitions, md5 sums and type hashes (description.hpp) walk the tables, so that
// they cannot disagree.
//
// To add one: a struct with `kType` and `fields` in wire order, an entry in description_test.cpp
// with its published md5 and hash, one line where it is published or read.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace pointflight::msg {

/// Package and name of a message; the package may differ between ROS 1 and ROS 2.
struct TypeName {
  const char* package = "";
  const char* name = "";
  const char* ros2_package = package;
  const char* constants = "";  ///< Lines "uint8 READY = 1", in the definition's order.
  bool ros1_only = false;      ///< No such type in ROS 2.
};

/// Built into ROS 1; builtin_interfaces in ROS 2.
struct Time {
  static constexpr TypeName kType{"builtin_interfaces", "Time"};
  std::int32_t sec = 0;
  std::uint32_t nanosec = 0;
  template <class M, class V>
  static void fields(M& m, V& v) {
    v("sec", m.sec);
    v("nanosec", m.nanosec);
  }
  bool operator==(const Time&) const = default;
};

struct Duration {
  static constexpr TypeName kType{"builtin_interfaces", "Duration"};
  std::int32_t sec = 0;
  std::uint32_t nanosec = 0;
  template <class M, class V>
  static void fields(M& m, V& v) {
    v("sec", m.sec);
    v("nanosec", m.nanosec);
  }
};

struct Header {
  static constexpr TypeName kType{"std_msgs", "Header"};
  std::uint32_t seq = 0;  ///< ROS 1 only.
  Time stamp;
  std::string frame_id;
  template <class M, class V>
  static void fields(M& m, V& v) {
    if constexpr (V::kRos == 1) v("seq", m.seq);
    v("stamp", m.stamp);
    v("frame_id", m.frame_id);
  }
};

struct Vector3 {
  static constexpr TypeName kType{"geometry_msgs", "Vector3"};
  double x = 0.0, y = 0.0, z = 0.0;
  template <class M, class V>
  static void fields(M& m, V& v) {
    v("x", m.x);
    v("y", m.y);
    v("z", m.z);
  }
};

struct Point {
  static constexpr TypeName kType{"geometry_msgs", "Point"};
  double x = 0.0, y = 0.0, z = 0.0;
  template <class M, class V>
  static void fields(M& m, V& v) {
    v("x", m.x);
    v("y", m.y);
    v("z", m.z);
  }
};

struct Quaternion {
  static constexpr TypeName kType{"geometry_msgs", "Quaternion"};
  double x = 0.0, y = 0.0, z = 0.0, w = 1.0;
  template <class M, class V>
  static void fields(M& m, V& v) {
    v("x", m.x);
    v("y", m.y);
    v("z", m.z);
    v("w", m.w);
  }
};

struct Pose {
  static constexpr TypeName kType{"geometry_msgs", "Pose"};
  Point position;
  Quaternion orientation;
  template <class M, class V>
  static void fields(M& m, V& v) {
    v("position", m.position);
    v("orientation", m.orientation);
  }
};

struct PoseWithCovariance {
  static constexpr TypeName kType{"geometry_msgs", "PoseWithCovariance"};
  Pose pose;
  std::array<double, 36> covariance{};
  template <class M, class V>
  static void fields(M& m, V& v) {
    v("pose", m.pose);
    v("covariance", m.covariance);
  }
};

struct Twist {
  static constexpr TypeName kType{"geometry_msgs", "Twist"};
  Vector3 linear, angular;
  template <class M, class V>
  static void fields(M& m, V& v) {
    v("linear", m.linear);
    v("angular", m.angular);
  }
};

struct TwistWithCovariance {
  static constexpr TypeName kType{"geometry_msgs", "TwistWithCovariance"};
  Twist twist;
  std::array<double, 36> covariance{};
  template <class M, class V>
  static void fields(M& m, V& v) {
    v("twist", m.twist);
    v("covariance", m.covariance);
  }
};

struct PoseStamped {
  static constexpr TypeName kType{"geometry_msgs", "PoseStamped"};
  Header header;
  Pose pose;
  template <class M, class V>
  static void fields(M& m, V& v) {
    v("header", m.header);
    v("pose", m.pose);
  }
};

struct TwistStamped {
  static constexpr TypeName kType{"geometry_msgs", "TwistStamped"};
  Header header;
  Twist twist;
  template <class M, class V>
  static void fields(M& m, V& v) {
    v("header", m.header);
    v("twist", m.twist);
  }
};

struct Transform {
  static constexpr TypeName kType{"geometry_msgs", "Transform"};
  Vector3 translation;
  Quaternion rotation;
  template <class M, class V>
  static void fields(M& m, V& v) {
    v("translation", m.translation);
    v("rotation", m.rotation);
  }
};

struct TransformStamped {
  static constexpr TypeName kType{"geometry_msgs", "TransformStamped"};
  Header header;
  std::string child_frame_id;
  Transform transform;
  template <class M, class V>
  static void fields(M& m, V& v) {
    v("header", m.header);
    v("child_frame_id", m.child_frame_id);
    v("transform", m.transform);
  }
};

struct TFMessage {
  static constexpr TypeName kType{"tf2_msgs", "TFMessage"};
  std::vector<TransformStamped> transforms;
  template <class M, class V>
  static void fields(M& m, V& v) {
    v("transforms", m.transforms);
  }
};

struct Odometry {
  static constexpr TypeName kType{"nav_msgs", "Odometry"};
  Header header;
  std::string child_frame_id;
  PoseWithCovariance pose;
  TwistWithCovariance twist;
  template <class M, class V>
  static void fields(M& m, V& v) {
    v("header", m.header);
    v("child_frame_id", m.child_frame_id);
    v("pose", m.pose);
    v("twist", m.twist);
  }
};

struct Path {
  static constexpr TypeName kType{"nav_msgs", "Path"};
  Header header;
  std::vector<PoseStamped> poses;
  template <class M, class V>
  static void fields(M& m, V& v) {
    v("header", m.header);
    v("poses", m.poses);
  }
};

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

struct Clock {
  static constexpr TypeName kType{"rosgraph_msgs", "Clock"};
  Time clock;
  template <class M, class V>
  static void fields(M& m, V& v) {
    v("clock", m.clock);
  }
};

struct ColorRGBA {
  static constexpr TypeName kType{"std_msgs", "ColorRGBA"};
  float r = 0.0f, g = 0.0f, b = 0.0f, a = 0.0f;
  template <class M, class V>
  static void fields(M& m, V& v) {
    v("r", m.r);
    v("g", m.g);
    v("b", m.b);
    v("a", m.a);
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

struct UVCoordinate {
  static constexpr TypeName kType{"visualization_msgs", "UVCoordinate"};
  float u = 0.0f, v = 0.0f;
  template <class M, class V>
  static void fields(M& m, V& visitor) {
    visitor("u", m.u);
    visitor("v", m.v);
  }
};

struct MeshFile {
  static constexpr TypeName kType{"visualization_msgs", "MeshFile"};
  std::string filename;
  std::vector<std::uint8_t> data;
  template <class M, class V>
  static void fields(M& m, V& v) {
    v("filename", m.filename);
    v("data", m.data);
  }
};

struct Marker {
  static constexpr TypeName kType{
      "visualization_msgs",
      "Marker",
      "visualization_msgs",
      "uint8 ARROW=0\nuint8 CUBE=1\nuint8 SPHERE=2\nuint8 CYLINDER=3\nuint8 LINE_STRIP=4\n"
      "uint8 LINE_LIST=5\nuint8 CUBE_LIST=6\nuint8 SPHERE_LIST=7\nuint8 POINTS=8\n"
      "uint8 TEXT_VIEW_FACING=9\nuint8 MESH_RESOURCE=10\nuint8 TRIANGLE_LIST=11\n"
      "uint8 ADD=0\nuint8 MODIFY=0\nuint8 DELETE=2\nuint8 DELETEALL=3\n"};
  enum Type : std::int32_t {
    kArrow = 0,
    kCube = 1,
    kSphere = 2,
    kCylinder = 3,
    kLineStrip = 4,
    kPoints = 8,
    kText = 9
  };
  enum Action : std::int32_t { kAdd = 0, kDelete = 2, kDeleteAll = 3 };
  Header header;
  std::string ns;
  std::int32_t id = 0, type = 0, action = 0;
  Pose pose;
  Vector3 scale;
  ColorRGBA color;
  Duration lifetime;
  bool frame_locked = false;
  std::vector<Point> points;
  std::vector<ColorRGBA> colors;
  std::string texture_resource;  ///< ROS 2 only, as the next two.
  CompressedImage texture;
  std::vector<UVCoordinate> uv_coordinates;
  std::string text, mesh_resource;
  MeshFile mesh_file;  ///< ROS 2 only.
  bool mesh_use_embedded_materials = false;
  template <class M, class V>
  static void fields(M& m, V& v) {
    v("header", m.header);
    v("ns", m.ns);
    v("id", m.id);
    v("type", m.type);
    v("action", m.action);
    v("pose", m.pose);
    v("scale", m.scale);
    v("color", m.color);
    v("lifetime", m.lifetime);
    v("frame_locked", m.frame_locked);
    v("points", m.points);
    v("colors", m.colors);
    if constexpr (V::kRos == 2) {
      v("texture_resource", m.texture_resource);
      v("texture", m.texture);
      v("uv_coordinates", m.uv_coordinates);
    }
    v("text", m.text);
    v("mesh_resource", m.mesh_resource);
    if constexpr (V::kRos == 2) v("mesh_file", m.mesh_file);
    v("mesh_use_embedded_materials", m.mesh_use_embedded_materials);
  }
};

struct MarkerArray {
  static constexpr TypeName kType{"visualization_msgs", "MarkerArray"};
  std::vector<Marker> markers;
  template <class M, class V>
  static void fields(M& m, V& v) {
    v("markers", m.markers);
  }
};

struct KeyValue {
  static constexpr TypeName kType{"diagnostic_msgs", "KeyValue"};
  std::string key, value;
  template <class M, class V>
  static void fields(M& m, V& v) {
    v("key", m.key);
    v("value", m.value);
  }
};

/// ROS type `byte`: an octet that is no number.
enum class Octet : std::uint8_t {};

struct DiagnosticStatus {
  static constexpr TypeName kType{"diagnostic_msgs",
                                  "DiagnosticStatus",
                                  "diagnostic_msgs",
                                  "byte OK=0\nbyte WARN=1\nbyte ERROR=2\nbyte STALE=3\n"};
  Octet level{};
  std::string name, message, hardware_id;
  std::vector<KeyValue> values;
  template <class M, class V>
  static void fields(M& m, V& v) {
    v("level", m.level);
    v("name", m.name);
    v("message", m.message);
    v("hardware_id", m.hardware_id);
    v("values", m.values);
  }
};

struct DiagnosticArray {
  static constexpr TypeName kType{"diagnostic_msgs", "DiagnosticArray"};
  Header header;
  std::vector<DiagnosticStatus> status;
  template <class M, class V>
  static void fields(M& m, V& v) {
    v("header", m.header);
    v("status", m.status);
  }
};

struct Bool {
  static constexpr TypeName kType{"std_msgs", "Bool"};
  bool data = false;
  template <class M, class V>
  static void fields(M& m, V& v) {
    v("data", m.data);
  }
};

/// In ROS 2 a message has at least one field.
inline constexpr const char* kNoField = "structure_needs_at_least_one_member";

struct Empty {
  static constexpr TypeName kType{"std_msgs", "Empty"};
  std::uint8_t none = 0;
  template <class M, class V>
  static void fields(M& m, V& v) {
    if constexpr (V::kRos == 2) v(kNoField, m.none);
  }
};

struct MultiArrayDimension {
  static constexpr TypeName kType{"std_msgs", "MultiArrayDimension"};
  std::string label;
  std::uint32_t size = 0, stride = 0;
  template <class M, class V>
  static void fields(M& m, V& v) {
    v("label", m.label);
    v("size", m.size);
    v("stride", m.stride);
  }
};

struct MultiArrayLayout {
  static constexpr TypeName kType{"std_msgs", "MultiArrayLayout"};
  std::vector<MultiArrayDimension> dim;
  std::uint32_t data_offset = 0;
  template <class M, class V>
  static void fields(M& m, V& v) {
    v("dim", m.dim);
    v("data_offset", m.data_offset);
  }
};

struct Float32MultiArray {
  static constexpr TypeName kType{"std_msgs", "Float32MultiArray"};
  MultiArrayLayout layout;
  std::vector<float> data;
  template <class M, class V>
  static void fields(M& m, V& v) {
    v("layout", m.layout);
    v("data", m.data);
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

struct AttitudeTarget {
  static constexpr TypeName kType{
      "mavros_msgs",
      "AttitudeTarget",
      "mavros_msgs",
      "uint8 IGNORE_ROLL_RATE = 1\nuint8 IGNORE_PITCH_RATE = 2\nuint8 IGNORE_YAW_RATE = 4\n"
      "uint8 IGNORE_THRUST = 64\nuint8 IGNORE_ATTITUDE = 128\n"};
  enum Mask : std::uint8_t {
    kIgnoreRollRate = 1,
    kIgnorePitchRate = 2,
    kIgnoreYawRate = 4,
    kIgnoreRates = 7,
    kIgnoreThrust = 64,
    kIgnoreAttitude = 128
  };
  Header header;
  std::uint8_t type_mask = 0;
  Quaternion orientation;
  Vector3 body_rate;
  float thrust = 0.0f;
  template <class M, class V>
  static void fields(M& m, V& v) {
    v("header", m.header);
    v("type_mask", m.type_mask);
    v("orientation", m.orientation);
    v("body_rate", m.body_rate);
    v("thrust", m.thrust);
  }
};

/// EGO-Planner, FUEL, RACER ("short").
struct PositionCommandShort {
  static constexpr TypeName kType{
      "quadrotor_msgs",
      "PositionCommand",
      "quadrotor_msgs",
      "uint8 TRAJECTORY_STATUS_EMPTY = 0\nuint8 TRAJECTORY_STATUS_READY = 1\n"
      "uint8 TRAJECTORY_STATUS_COMPLETED = 3\nuint8 TRAJECTROY_STATUS_ABORT = 4\n"
      "uint8 TRAJECTORY_STATUS_ILLEGAL_START = 5\nuint8 TRAJECTORY_STATUS_ILLEGAL_FINAL = 6\n"
      "uint8 TRAJECTORY_STATUS_IMPOSSIBLE = 7\n"};
  Header header;
  Point position;
  Vector3 velocity, acceleration;
  double yaw = 0.0, yaw_dot = 0.0;
  std::array<double, 3> kx{}, kv{};
  std::uint32_t trajectory_id = 0;
  std::uint8_t trajectory_flag = 0;
  template <class M, class V>
  static void fields(M& m, V& v) {
    v("header", m.header);
    v("position", m.position);
    v("velocity", m.velocity);
    v("acceleration", m.acceleration);
    v("yaw", m.yaw);
    v("yaw_dot", m.yaw_dot);
    v("kx", m.kx);
    v("kv", m.kv);
    v("trajectory_id", m.trajectory_id);
    v("trajectory_flag", m.trajectory_flag);
  }
};

/// MARSIM, SUPER, ROG-Map ("long").
struct PositionCommandLong {
  static constexpr TypeName kType{
      "quadrotor_msgs",
      "PositionCommand",
      "mars_quadrotor_msgs",
      "uint8 TRAJECTORY_STATUS_EMPTY = 0\nuint8 TRAJECTORY_STATUS_EMER = 2\n"
      "uint8 TRAJECTORY_STATUS_READY = 1\nuint8 TRAJECTORY_STATUS_COMPLETED = 3\n"
      "uint8 TRAJECTROY_STATUS_ABORT = 4\nuint8 TRAJECTORY_STATUS_ILLEGAL_START = 5\n"
      "uint8 TRAJECTORY_STATUS_ILLEGAL_FINAL = 6\nuint8 TRAJECTORY_STATUS_IMPOSSIBLE = 7\n"
      "uint32 ACTION_STOP = 8\n"};
  Header header;
  Point position;
  Vector3 velocity, acceleration, jerk, angular_velocity, attitude, thrust;
  double yaw = 0.0, yaw_dot = 0.0, vel_norm = 0.0, acc_norm = 0.0;
  std::array<double, 3> kx{}, kv{};
  std::uint32_t trajectory_id = 0;
  std::uint8_t trajectory_flag = 0;
  template <class M, class V>
  static void fields(M& m, V& v) {
    v("header", m.header);
    v("position", m.position);
    v("velocity", m.velocity);
    v("acceleration", m.acceleration);
    v("jerk", m.jerk);
    v("angular_velocity", m.angular_velocity);
    v("attitude", m.attitude);
    v("thrust", m.thrust);
    v("yaw", m.yaw);
    v("yaw_dot", m.yaw_dot);
    v("vel_norm", m.vel_norm);
    v("acc_norm", m.acc_norm);
    v("kx", m.kx);
    v("kv", m.kv);
    v("trajectory_id", m.trajectory_id);
    v("trajectory_flag", m.trajectory_flag);
  }
};

/// multi_map_server's copy in FUEL and RACER ("oldest").
struct PositionCommandOldest {
  static constexpr TypeName kType{"quadrotor_msgs", "PositionCommand", "quadrotor_msgs", "", true};
  Header header;
  Point position;
  Vector3 velocity, acceleration;
  double yaw = 0.0, yaw_dot = 0.0;
  std::array<double, 3> kx{}, kv{};
  template <class M, class V>
  static void fields(M& m, V& v) {
    v("header", m.header);
    v("position", m.position);
    v("velocity", m.velocity);
    v("acceleration", m.acceleration);
    v("yaw", m.yaw);
    v("yaw_dot", m.yaw_dot);
    v("kx", m.kx);
    v("kv", m.kv);
  }
};

/// Take-off and landing by EGO-Planner's and px4ctrl's message.
struct TakeoffLand {
  static constexpr TypeName kType{
      "quadrotor_msgs", "TakeoffLand", "quadrotor_msgs", "uint8 TAKEOFF = 1\nuint8 LAND = 2\n"};
  enum Command : std::uint8_t { kTakeoff = 1, kLand = 2 };
  std::uint8_t takeoff_land_cmd = 0;
  template <class M, class V>
  static void fields(M& m, V& v) {
    v("takeoff_land_cmd", m.takeoff_land_cmd);
  }
};

/// Plain text.
struct String {
  static constexpr TypeName kType{"std_msgs", "String"};
  std::string data;
  template <class M, class V>
  static void fields(M& m, V& v) {
    v("data", m.data);
  }
};

}  // namespace pointflight::msg
