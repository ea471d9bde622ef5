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

  [[nodiscard]] Vector3d operator*(const Vector3d& point) const {
    return rotation * point + translation;
  }
  [[nodiscard]] Pose operator*(const Pose& other) const {
    return {rotation * other.rotation, rotation * other.translation + translation};
  }
  [[nodiscard]] Pose inverse() const {
    const Quaterniond back = rotation.conjugate();
    return {back, back * (-translation)};
  }
};

/// Axis-aligned box, empty (min > max) until something is added.
struct Aabb {
  Vector3d min = Vector3d::Constant(std::numeric_limits<double>::infinity());
  Vector3d max = Vector3d::Constant(-std::numeric_limits<double>::infinity());

  void add(const Vector3d& point) {
    min = min.cwiseMin(point);
    max = max.cwiseMax(point);
  }
  [[nodiscard]] bool empty() const { return min.x() > max.x(); }
  [[nodiscard]] Vector3d size() const { return max - min; }
};

/// A half-line in the world with an end.
struct Ray {
  Vector3d origin_world = Vector3d::Zero();      ///< Metres.
  Vector3f direction_world = Vector3f::UnitX();  ///< Unit vector.
  float range_max = 1e9f;                        ///< Metres along the ray.
};

}  // namespace pointflight
