#pragma once

#include "pointflight/geometry/types.hpp"

/// @file
/// Rotations through core/math.hpp: the same bits on every CPU (Eigen's AngleAxis and slerp call
/// libm).
namespace pointflight {

/// Rotation by |v| radians about v. Exact to second order at zero.
Quaterniond quaternion_from_rotation_vector(const Vector3d& v);

/// The shortest rotation vector of a unit quaternion, length 0 .. pi.
Vector3d rotation_vector(const Quaterniond& q);

/// Intrinsic yaw (z), then pitch (y), then roll (x), radians: R = Rz(yaw) Ry(pitch) Rx(roll), REP
/// 103.
Quaterniond quaternion_from_rpy(double roll, double pitch, double yaw);

/// Heading of the body's x axis in the horizontal plane, (-pi, pi].
double yaw_of(const Quaterniond& q_world_body);

/// Between a (share 0) and b (share 1) along the shorter arc; normalised linear interpolation,
/// whose error against slerp is below 1e-9 rad for the few milliradians between physics steps.
Quaterniond interpolate(const Quaterniond& a, const Quaterniond& b, double share);

/// Between two poses: linear in position, along the shorter arc in rotation.
Pose interpolate(const Pose& a, const Pose& b, double share);

/// `angle` moved by whole turns into (-pi, pi].
double wrap_angle(double angle);

}  // namespace pointflight
