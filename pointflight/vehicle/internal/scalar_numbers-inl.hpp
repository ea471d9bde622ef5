// States of one vehicle as numbers (number-inl.hpp), and back. Scalar code only.
#pragma once

#include <vector>

#include "pointflight/vehicle/internal/multirotor-inl.hpp"
#include "pointflight/vehicle/multirotor.hpp"

HWY_BEFORE_NAMESPACE();
namespace pointflight::HWY_NAMESPACE {

inline Vec3<double> numbers_of(const Vector3d& v) {
  return {v.x(), v.y(), v.z()};
}
inline Vector3d vector_of(const Vec3<double>& v) {
  return {v.x, v.y, v.z};
}
inline Mat3<double> numbers_of(const Matrix3d& m) {
  return {numbers_of(Vector3d(m.col(0))),
          numbers_of(Vector3d(m.col(1))),
          numbers_of(Vector3d(m.col(2)))};
}
inline Matrix3d matrix_from(const Mat3<double>& m) {
  Matrix3d matrix;
  matrix << vector_of(m.x), vector_of(m.y), vector_of(m.z);
  return matrix;
}
inline Quat<double> numbers_of(const Quaterniond& q) {
  return {q.x(), q.y(), q.z(), q.w()};
}
inline BodyNumbers<double> numbers_of(const RigidBodyState& s) {
  return {numbers_of(s.p_world),
          numbers_of(s.v_world),
          numbers_of(s.q_world_body),
          numbers_of(s.omega_body)};
}
inline RigidBodyState state_of(const BodyNumbers<double>& b) {
  return {
      vector_of(b.p), vector_of(b.v), Quaterniond(b.q.w, b.q.x, b.q.y, b.q.z), vector_of(b.omega)};
}
inline AirNumbers<double> numbers_of(const FlightConditions& conditions) {
  return {numbers_of(conditions.wind_world), conditions.ground_z, conditions.load_share};
}
inline void put(const std::vector<RotorState>& rotors, RotorNumbers<double>& numbers) {
  for (std::size_t i = 0; i < rotors.size(); ++i) {
    numbers.speed[i] = rotors[i].speed;
    numbers.acceleration[i] = rotors[i].acceleration;
  }
}
inline void put(const RotorNumbers<double>& numbers, std::vector<RotorState>& rotors) {
  for (std::size_t i = 0; i < rotors.size(); ++i) {
    rotors[i] = {numbers.speed[i], numbers.acceleration[i]};
  }
}

}  // namespace pointflight::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
