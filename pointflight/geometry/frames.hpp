// From our frames to those of flight controllers: the world east, north, up to north, east, down;
// the body front, left, up to front, right, down.
#pragma once

#include <array>

#include "pointflight/geometry/types.hpp"

namespace pointflight {

/// A vector of the world; its own inverse.
inline Vector3d ned_from_enu(const Vector3d& v) {
  return {v.y(), v.x(), -v.z()};
}

/// A vector of the body; its own inverse.
inline Vector3d frd_from_flu(const Vector3d& v) {
  return {v.x(), -v.y(), -v.z()};
}

/// Attitude of the body: of front, right, down in north, east, down; its own inverse.
inline Quaterniond q_ned_frd(const Quaterniond& q_enu_flu) {
  // by half a turn about the bisector of the world's x and y, and about the body's x
  constexpr double kHalf = 0.70710678118654752440;
  return Quaterniond(0.0, kHalf, kHalf, 0.0) * q_enu_flu * Quaterniond(0.0, -1.0, 0.0, 0.0);
}

/// As messages have it.
inline std::array<float, 3> floats(const Vector3d& v) {
  return {static_cast<float>(v.x()), static_cast<float>(v.y()), static_cast<float>(v.z())};
}

/// The same, w first, with w not negative.
inline std::array<float, 4> floats(const Quaterniond& q) {
  const double sign = q.w() < 0.0 ? -1.0 : 1.0;
  return {static_cast<float>(sign * q.w()),
          static_cast<float>(sign * q.x()),
          static_cast<float>(sign * q.y()),
          static_cast<float>(sign * q.z())};
}

}  // namespace pointflight
