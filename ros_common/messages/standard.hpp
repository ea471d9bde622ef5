// What all others are made of: std_msgs, times, the clock.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace pointflight::msg {

/// Package and name of a message; the package may differ between ROS 1 and ROS 2.
///
/// Every message is a struct with such a `kType` and a static `fields(message, visitor)`, which
/// calls `visitor(name, field)` for each field in the order of the wire: codecs and definitions
/// walk it. `V::kRos` of the visitor, 1 or 2, tells which ROS is meant.
struct TypeName {
  const char* package = "";            ///< Of ROS 1.
  const char* name = "";               ///< The same in both.
  const char* ros2_package = package;  ///< Of ROS 2: `package` unless it differs.
  const char* constants = "";          ///< Lines "uint8 READY = 1", in the definition's order.
  bool ros1_only = false;              ///< No such type in ROS 2.
};

/// Built into ROS 1; builtin_interfaces in ROS 2.
struct Time {
  static constexpr TypeName kType{"builtin_interfaces", "Time"};
  std::int32_t sec = 0;       ///< Since the Unix epoch.
  std::uint32_t nanosec = 0;  ///< Up to 999,999,999; "nsec" among ROS 1's programs.
  template <class M, class V>
  static void fields(M& m, V& v) {
    v("sec", m.sec);
    v("nanosec", m.nanosec);
  }
  /// To the nanosecond.
  bool operator==(const Time&) const = default;
};

/// A length of time; negative ones count from below: -0.5 s is -1 and 500,000,000.
struct Duration {
  static constexpr TypeName kType{"builtin_interfaces", "Duration"};
  std::int32_t sec = 0;       ///< Whole seconds, rounded down.
  std::uint32_t nanosec = 0;  ///< Up to 999,999,999.
  template <class M, class V>
  static void fields(M& m, V& v) {
    v("sec", m.sec);
    v("nanosec", m.nanosec);
  }
};

/// Where and when something was measured.
struct Header {
  static constexpr TypeName kType{"std_msgs", "Header"};
  std::uint32_t seq = 0;  ///< ROS 1 only.
  Time stamp;             ///< From the profile's epoch: `stamp_of`.
  std::string frame_id;   ///< Without a leading slash.
  template <class M, class V>
  static void fields(M& m, V& v) {
    if constexpr (V::kRos == 1) v("seq", m.seq);
    v("stamp", m.stamp);
    v("frame_id", m.frame_id);
  }
};

/// A colour for RViz.
struct ColorRGBA {
  static constexpr TypeName kType{"std_msgs", "ColorRGBA"};
  /// 0 to 1; a of 0 is invisible.
  ///@{
  float r = 0.0f, g = 0.0f, b = 0.0f, a = 0.0f;
  ///@}
  template <class M, class V>
  static void fields(M& m, V& v) {
    v("r", m.r);
    v("g", m.g);
    v("b", m.b);
    v("a", m.a);
  }
};

/// For orders to pause.
struct Bool {
  static constexpr TypeName kType{"std_msgs", "Bool"};
  bool data = false;  ///< True: pause.
  template <class M, class V>
  static void fields(M& m, V& v) {
    v("data", m.data);
  }
};

/// In ROS 2 a message has at least one field.
inline constexpr const char* kNoField = "structure_needs_at_least_one_member";

/// For orders that need no words: hover, arm, step, reset.
struct Empty {
  static constexpr TypeName kType{"std_msgs", "Empty"};
  std::uint8_t none = 0;  ///< Of no meaning: see kNoField.
  template <class M, class V>
  static void fields(M& m, V& v) {
    if constexpr (V::kRos == 2) v(kNoField, m.none);
  }
};

/// Plain text.
struct String {
  static constexpr TypeName kType{"std_msgs", "String"};
  std::string data;  ///< UTF-8 is taken as it is.
  template <class M, class V>
  static void fields(M& m, V& v) {
    v("data", m.data);
  }
};

/// One axis of an array.
struct MultiArrayDimension {
  static constexpr TypeName kType{"std_msgs", "MultiArrayDimension"};
  std::string label;  ///< What it counts.
  /// Items along it; items to the next index of the axis before.
  ///@{
  std::uint32_t size = 0, stride = 0;
  ///@}
  template <class M, class V>
  static void fields(M& m, V& v) {
    v("label", m.label);
    v("size", m.size);
    v("stride", m.stride);
  }
};

/// How an array's numbers lie.
struct MultiArrayLayout {
  static constexpr TypeName kType{"std_msgs", "MultiArrayLayout"};
  std::vector<MultiArrayDimension> dim;  ///< The outermost first; empty for a plain list.
  std::uint32_t data_offset = 0;         ///< Items before the first that counts.
  template <class M, class V>
  static void fields(M& m, V& v) {
    v("dim", m.dim);
    v("data_offset", m.data_offset);
  }
};

/// Numbers: rotor speeds go out and come in as this.
struct Float32MultiArray {
  static constexpr TypeName kType{"std_msgs", "Float32MultiArray"};
  MultiArrayLayout layout;  ///< Empty here, and not looked at.
  /// By the vehicle file's order: out in rpm, in as the input's settings say.
  std::vector<float> data;
  template <class M, class V>
  static void fields(M& m, V& v) {
    v("layout", m.layout);
    v("data", m.data);
  }
};

/// The run's time, for programs with use_sim_time.
struct Clock {
  static constexpr TypeName kType{"rosgraph_msgs", "Clock"};
  Time clock;  ///< What all stamps of now would be.
  template <class M, class V>
  static void fields(M& m, V& v) {
    v("clock", m.clock);
  }
};

}  // namespace pointflight::msg
