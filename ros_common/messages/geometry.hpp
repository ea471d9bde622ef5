// Where things are and how they move: geometry_msgs, tf2_msgs, nav_msgs.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "ros_common/messages/standard.hpp"

namespace pointflight::msg {

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

}  // namespace pointflight::msg
