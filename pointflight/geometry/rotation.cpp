#include "pointflight/geometry/rotation.hpp"

#include <cmath>

#include "pointflight/core/constants.hpp"
#include "pointflight/core/math.hpp"

namespace pointflight {

Quaterniond quaternion_from_rotation_vector(const Vector3d& v) {
  const double angle = v.norm();
  if (angle < 1e-12) return Quaterniond(1.0, 0.5 * v.x(), 0.5 * v.y(), 0.5 * v.z()).normalized();
  const auto half = math::sincos(0.5 * angle);
  const Vector3d xyz = v * (half.sin / angle);
  return {half.cos, xyz.x(), xyz.y(), xyz.z()};
}

Vector3d rotation_vector(const Quaterniond& q) {
  const double sign = q.w() < 0.0 ? -1.0 : 1.0;
  const Vector3d xyz = sign * q.vec();
  const double sine = xyz.norm();
  if (sine < 1e-12) return 2.0 * xyz;
  return xyz * (2.0 * math::atan2(sine, sign * q.w()) / sine);
}

Quaterniond quaternion_from_rpy(double roll, double pitch, double yaw) {
  const auto r = math::sincos(0.5 * roll);
  const auto p = math::sincos(0.5 * pitch);
  const auto y = math::sincos(0.5 * yaw);
  return Quaterniond(y.cos, 0, 0, y.sin) * Quaterniond(p.cos, 0, p.sin, 0) *
         Quaterniond(r.cos, r.sin, 0, 0);
}

double yaw_of(const Quaterniond& q) {
  return math::atan2(2.0 * (q.w() * q.z() + q.x() * q.y()),
                     1.0 - 2.0 * (q.y() * q.y() + q.z() * q.z()));
}

Quaterniond interpolate(const Quaterniond& a, const Quaterniond& b, double share) {
  const double sign = a.dot(b) < 0.0 ? -1.0 : 1.0;
  Quaterniond q;
  q.coeffs() = (1.0 - share) * a.coeffs() + (share * sign) * b.coeffs();
  q.normalize();
  return q;
}

Pose interpolate(const Pose& a, const Pose& b, double share) {
  return {interpolate(a.rotation, b.rotation, share),
          (1.0 - share) * a.translation + share * b.translation};
}

double wrap_angle(double angle) {
  return angle - 2.0 * kPi * std::ceil(angle / (2.0 * kPi) - 0.5);
}

}  // namespace pointflight
