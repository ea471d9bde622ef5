// Where things are and how they move: geometry_msgs, tf2_msgs, nav_msgs.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "ros_common/messages/standard.hpp"

namespace pointflight::msg {

/// A direction with a length: turned, but not moved, by a change of frames.
struct Vector3 {
  static constexpr TypeName kType{"geometry_msgs", "Vector3"};
  /// In the unit of what it is of.
  ///@{
  double x = 0.0, y = 0.0, z = 0.0;
  ///@}
  template <class M, class V>
  static void fields(M& m, V& v) {
    v("x", m.x);
    v("y", m.y);
    v("z", m.z);
  }
};

/// A place: turned and moved by a change of frames.
struct Point {
  static constexpr TypeName kType{"geometry_msgs", "Point"};
  /// m
  ///@{
  double x = 0.0, y = 0.0, z = 0.0;
  ///@}
  template <class M, class V>
  static void fields(M& m, V& v) {
    v("x", m.x);
    v("y", m.y);
    v("z", m.z);
  }
};

/// Hamilton, as Eigen's; the real part comes last.
struct Quaternion {
  static constexpr TypeName kType{"geometry_msgs", "Quaternion"};
  /// Unit length; no rotation by default.
  ///@{
  double x = 0.0, y = 0.0, z = 0.0, w = 1.0;
  ///@}
  template <class M, class V>
  static void fields(M& m, V& v) {
    v("x", m.x);
    v("y", m.y);
    v("z", m.z);
    v("w", m.w);
  }
};

/// Where something is and how it is turned.
struct Pose {
  static constexpr TypeName kType{"geometry_msgs", "Pose"};
  Point position;          ///< m
  Quaternion orientation;  ///< Of its own axes in the header's frame.
  template <class M, class V>
  static void fields(M& m, V& v) {
    v("position", m.position);
    v("orientation", m.orientation);
  }
};

/// A pose as an estimator knows it.
struct PoseWithCovariance {
  static constexpr TypeName kType{"geometry_msgs", "PoseWithCovariance"};
  Pose pose;  ///< The likeliest.
  /// Row by row: x, y, z, then rotations about them; m^2, rad^2. Zeros for the truth.
  std::array<double, 36> covariance{};
  template <class M, class V>
  static void fields(M& m, V& v) {
    v("pose", m.pose);
    v("covariance", m.covariance);
  }
};

/// How something moves.
struct Twist {
  static constexpr TypeName kType{"geometry_msgs", "Twist"};
  /// m/s and rad/s.
  ///@{
  Vector3 linear, angular;
  ///@}
  template <class M, class V>
  static void fields(M& m, V& v) {
    v("linear", m.linear);
    v("angular", m.angular);
  }
};

/// A twist as an estimator knows it.
struct TwistWithCovariance {
  static constexpr TypeName kType{"geometry_msgs", "TwistWithCovariance"};
  Twist twist;  ///< The likeliest.
  /// Row by row as in PoseWithCovariance; m^2/s^2, rad^2/s^2. Zeros for the truth.
  std::array<double, 36> covariance{};
  template <class M, class V>
  static void fields(M& m, V& v) {
    v("twist", m.twist);
    v("covariance", m.covariance);
  }
};

/// A pose at a time in a frame: goals come as this.
struct PoseStamped {
  static constexpr TypeName kType{"geometry_msgs", "PoseStamped"};
  Header header;  ///< Frame of the pose.
  Pose pose;      ///< A goal's z of 0 keeps the height (`WaypointCommand::keep_height`).
  template <class M, class V>
  static void fields(M& m, V& v) {
    v("header", m.header);
    v("pose", m.pose);
  }
};

/// A twist at a time in a frame: velocities come as this.
struct TwistStamped {
  static constexpr TypeName kType{"geometry_msgs", "TwistStamped"};
  Header header;  ///< Frame of the twist; empty: as the input's settings say.
  Twist twist;    ///< Of an order only the velocity and the rate about z count.
  template <class M, class V>
  static void fields(M& m, V& v) {
    v("header", m.header);
    v("twist", m.twist);
  }
};

/// How one frame lies in another.
struct Transform {
  static constexpr TypeName kType{"geometry_msgs", "Transform"};
  Vector3 translation;  ///< m
  Quaternion rotation;  ///< Of the child's axes in the parent's.
  template <class M, class V>
  static void fields(M& m, V& v) {
    v("translation", m.translation);
    v("rotation", m.rotation);
  }
};

/// One link of the tree of frames.
struct TransformStamped {
  static constexpr TypeName kType{"geometry_msgs", "TransformStamped"};
  Header header;               ///< The parent frame.
  std::string child_frame_id;  ///< The child frame.
  Transform transform;         ///< T_parent_child.
  template <class M, class V>
  static void fields(M& m, V& v) {
    v("header", m.header);
    v("child_frame_id", m.child_frame_id);
    v("transform", m.transform);
  }
};

/// What /tf and /tf_static carry.
struct TFMessage {
  static constexpr TypeName kType{"tf2_msgs", "TFMessage"};
  std::vector<TransformStamped> transforms;  ///< In any order; each child has one parent.
  template <class M, class V>
  static void fields(M& m, V& v) {
    v("transforms", m.transforms);
  }
};

/// Pose and velocities of a vehicle: `odometry_of`.
struct Odometry {
  static constexpr TypeName kType{"nav_msgs", "Odometry"};
  Header header;  ///< Frame of the pose.
  /// Frame of the twist (REP 105), but for profiles with `twist: world`.
  std::string child_frame_id;
  PoseWithCovariance pose;    ///< Of the body.
  TwistWithCovariance twist;  ///< Of the body.
  template <class M, class V>
  static void fields(M& m, V& v) {
    v("header", m.header);
    v("child_frame_id", m.child_frame_id);
    v("pose", m.pose);
    v("twist", m.twist);
  }
};

/// Where a vehicle has flown.
struct Path {
  static constexpr TypeName kType{"nav_msgs", "Path"};
  Header header;                   ///< Frame of all poses.
  std::vector<PoseStamped> poses;  ///< The oldest first.
  template <class M, class V>
  static void fields(M& m, V& v) {
    v("header", m.header);
    v("poses", m.poses);
  }
};

}  // namespace pointflight::msg
