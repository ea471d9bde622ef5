#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <limits>

namespace pointflight {

using Eigen::Matrix3d;
using Eigen::Matrix3f;
using Eigen::Quaterniond;
using Eigen::Vector3d;
using Eigen::Vector3f;

/// Rigid transform. `T_world_body` maps body coordinates to world: p_world = T_world_body * p_body.
struct Pose {
  Quaterniond rotation = Quaterniond::Identity();  ///< Unit quaternion.
  Vector3d translation = Vector3d::Zero();         ///< Metres.

  /// The point, given in the frame mapped from, in the frame mapped to.
  [[nodiscard]] Vector3d operator*(const Vector3d& point) const {
    return rotation * point + translation;
  }
  /// T_a_c = T_a_b * T_b_c: the other one first.
  [[nodiscard]] Pose operator*(const Pose& other) const {
    return {rotation * other.rotation, rotation * other.translation + translation};
  }
  /// T_b_a of T_a_b.
  [[nodiscard]] Pose inverse() const {
    const Quaterniond back = rotation.conjugate();
    return {back, back * (-translation)};
  }
};

/// Axis-aligned box, empty (min > max) until something is added.
struct Aabb {
  /// Least coordinates, m.
  Vector3d min = Vector3d::Constant(std::numeric_limits<double>::infinity());
  /// Greatest coordinates, m; they belong to the box.
  Vector3d max = Vector3d::Constant(-std::numeric_limits<double>::infinity());

  /// Grows the box until it holds the point, m.
  void add(const Vector3d& point) {
    min = min.cwiseMin(point);
    max = max.cwiseMax(point);
  }
  /// True until a point was added; a box of a single point is not empty.
  [[nodiscard]] bool empty() const { return min.x() > max.x(); }
  /// Length of its sides, m; -infinity if it is empty.
  [[nodiscard]] Vector3d size() const { return max - min; }
};

/// A half-line in the world with an end.
struct Ray {
  Vector3d origin_world = Vector3d::Zero();      ///< Metres.
  Vector3f direction_world = Vector3f::UnitX();  ///< Unit vector.
  float range_max = 1e9f;                        ///< Metres along the ray.
};

}  // namespace pointflight
