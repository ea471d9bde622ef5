// What all others are made of: std_msgs, times, the clock.
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

/// Plain text.
struct String {
  static constexpr TypeName kType{"std_msgs", "String"};
  std::string data;
  template <class M, class V>
  static void fields(M& m, V& v) {
    v("data", m.data);
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

struct Clock {
  static constexpr TypeName kType{"rosgraph_msgs", "Clock"};
  Time clock;
  template <class M, class V>
  static void fields(M& m, V& v) {
    v("clock", m.clock);
  }
};

}  // namespace pointflight::msg
