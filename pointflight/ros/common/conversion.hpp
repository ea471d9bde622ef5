// Samples of the simulation as messages: the one place where frames, units and signs of ROS are
// decided. World frame ENU (REP 103), body FLU, times from an epoch.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "pointflight/geometry/types.hpp"
#include "pointflight/ros/common/messages.hpp"
#include "pointflight/sim/samples.hpp"
#include "pointflight/vehicle/airframe.hpp"

namespace pointflight {

/// header.stamp and header.frame_id.
msg::Header header_of(SimTime time, Duration epoch, const std::string& frame);

/// A position.
msg::Point point_of(const Vector3d& v);
/// A direction.
msg::Vector3 vector_of(const Vector3d& v);
/// As it is: not normalised.
msg::Quaternion quaternion_of(const Quaterniond& q);
/// In the frame that it is given in.
msg::Pose pose_of(const Pose& pose);

/// A position; what is not finite stays so.
Vector3d vector_of(const msg::Point& v);
/// A direction; what is not finite stays so.
Vector3d vector_of(const msg::Vector3& v);
/// Normalised; identity if it is zero or not finite.
Quaterniond rotation_of(const msg::Quaternion& q);

/// Pose in the header's frame, velocities in the body's (REP 105: the child frame's), or in the
/// world's with `twist_in_world`.
msg::Odometry odometry_of(const RigidBodyState& state,
                          const msg::Header& header,
                          const std::string& child_frame,
                          bool twist_in_world);

/// Fills in the covariances of pose and twist: diagonal; rates are the gyroscope's, without one.
void add_variance(msg::Odometry& odometry, const EstimateVariance& variance);

/// Conventions for published accelerations.
struct ImuConventions {
  bool in_g = false;          ///< Units of 9.80665 m/s^2, as Livox' drivers send them.
  bool gravity_down = false;  ///< a + g instead of a - g: MARSIM.
};

/// Rates and specific force in the IMU's axes with the covariances of the vehicle's noise, and the
/// true attitude of those axes.
msg::Imu imu_of(const ImuSample& sample,
                const ImuSettings& settings,
                const msg::Header& header,
                const ImuConventions& customs);

/// `header`: the parent's frame.
msg::TransformStamped transform_of(const Pose& T_parent_child,
                                   const msg::Header& header,
                                   const std::string& child_frame);

/// Orientation of an optical frame (z ahead, x right, y down) of a body or sensor.
Quaterniond optical(const Quaterniond& q_world_sensor);

/// A shape as a marker around its pose.
msg::Marker marker_of(const Solid& solid,
                      const Pose& T_world_body,
                      const msg::Header& header,
                      const std::string& ns,
                      std::int32_t id,
                      const msg::ColorRGBA& color);

}  // namespace pointflight
