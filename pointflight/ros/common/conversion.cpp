#include "pointflight/ros/common/conversion.hpp"

#include "pointflight/ros/common/point_layout.hpp"

namespace pointflight {
namespace {

constexpr double kStandardGravity = 9.80665;  // what a g is, m/s^2

/// The three on the diagonal of a covariance of nine.
std::array<double, 9> diagonal(double variance) {
  std::array<double, 9> covariance{};
  covariance[0] = covariance[4] = covariance[8] = variance;
  return covariance;
}

/// Variance of a sample of white noise with this density.
double variance_of(double density, double rate) {
  return density * density * rate;
}

}  // namespace

msg::Header header_of(SimTime time, Duration epoch, const std::string& frame) {
  msg::Header header;
  header.stamp = stamp_of(time, epoch);
  header.frame_id = frame;
  return header;
}

msg::Point point_of(const Vector3d& v) {
  return {v.x(), v.y(), v.z()};
}
msg::Vector3 vector_of(const Vector3d& v) {
  return {v.x(), v.y(), v.z()};
}
msg::Quaternion quaternion_of(const Quaterniond& q) {
  return {q.x(), q.y(), q.z(), q.w()};
}
msg::Pose pose_of(const Pose& pose) {
  return {point_of(pose.translation), quaternion_of(pose.rotation)};
}

Vector3d vector_of(const msg::Point& v) {
  return {v.x, v.y, v.z};
}
Vector3d vector_of(const msg::Vector3& v) {
  return {v.x, v.y, v.z};
}

Quaterniond rotation_of(const msg::Quaternion& q) {
  const Quaterniond rotation(q.w, q.x, q.y, q.z);
  const double norm = rotation.norm();
  if (!(norm > 1e-6) || !(norm < 1e6)) return Quaterniond::Identity();
  return rotation.normalized();
}

msg::Odometry odometry_of(const RigidBodyState& state,
                          const msg::Header& header,
                          const std::string& child_frame,
                          bool twist_in_world) {
  msg::Odometry odometry;
  odometry.header = header;
  odometry.child_frame_id = child_frame;
  odometry.pose.pose = pose_of(state.T_world_body());
  const Quaterniond turn =
      twist_in_world ? Quaterniond::Identity() : state.q_world_body.conjugate();
  odometry.twist.twist.linear = vector_of(Vector3d(turn * state.v_world));
  odometry.twist.twist.angular = vector_of(
      twist_in_world ? Vector3d(state.q_world_body * state.omega_body) : state.omega_body);
  return odometry;
}

void add_variance(msg::Odometry& odometry, const EstimateVariance& variance) {
  const auto set = [](auto& covariance, std::size_t row, double value) {
    covariance[7 * row] = value;
  };
  for (std::size_t axis = 0; axis < 3; ++axis) {
    set(odometry.pose.covariance, axis, variance.position);
    set(odometry.pose.covariance, 3 + axis, axis == 2 ? variance.yaw : variance.tilt);
    set(odometry.twist.covariance, axis, variance.velocity);
  }
}

msg::Imu imu_of(const ImuSample& sample,
                const ImuSettings& settings,
                const msg::Header& header,
                const ImuConventions& customs) {
  msg::Imu imu;
  imu.header = header;
  imu.orientation = quaternion_of(sample.q_world_imu);
  imu.angular_velocity = vector_of(sample.gyro);
  imu.angular_velocity_covariance =
      diagonal(variance_of(settings.in_use().gyro.noise_density, settings.rate));
  Vector3d accel = sample.accel;
  if (customs.gravity_down) {
    accel -= sample.q_world_imu.conjugate() * Vector3d(0, 0, 2.0 * kGravity);
  }
  const double unit = customs.in_g ? kStandardGravity : 1.0;
  imu.linear_acceleration = vector_of(Vector3d(accel / unit));
  imu.linear_acceleration_covariance =
      diagonal(variance_of(settings.in_use().accel.noise_density / unit, settings.rate));
  return imu;
}

msg::TransformStamped transform_of(const Pose& T_parent_child,
                                   const msg::Header& header,
                                   const std::string& child_frame) {
  msg::TransformStamped transform;
  transform.header = header;
  transform.child_frame_id = child_frame;
  transform.transform.translation = vector_of(T_parent_child.translation);
  transform.transform.rotation = quaternion_of(T_parent_child.rotation);
  return transform;
}

Quaterniond optical(const Quaterniond& q_world_sensor) {
  // columns: the optical x, y, z axes in the sensor's
  Matrix3d turn;
  turn << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  return q_world_sensor * Quaterniond(turn);
}

msg::Marker marker_of(const Solid& solid,
                      const Pose& T_world_body,
                      const msg::Header& header,
                      const std::string& ns,
                      std::int32_t id,
                      const msg::ColorRGBA& color) {
  msg::Marker marker;
  marker.header = header;
  marker.ns = ns;
  marker.id = id;
  marker.action = msg::Marker::ADD;
  const PlainShape outline = plain_shape_of(solid);
  marker.type = outline == PlainShape::kSphere ? msg::Marker::SPHERE
                : outline == PlainShape::kBox  ? msg::Marker::CUBE
                                               : msg::Marker::CYLINDER;
  marker.pose = pose_of(T_world_body);
  marker.scale = vector_of(Vector3d(2.0 * half_extent(solid)));
  marker.color = color;
  return marker;
}

}  // namespace pointflight
