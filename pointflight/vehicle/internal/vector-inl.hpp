// Vectors, rotations and matrices of numbers (number-inl.hpp): the operations that flight needs, in
// the order of Eigen's for doubles.
#if defined(POINTFLIGHT_VEHICLE_VECTOR_INL_HPP) == defined(HWY_TARGET_TOGGLE)
#ifdef POINTFLIGHT_VEHICLE_VECTOR_INL_HPP
#undef POINTFLIGHT_VEHICLE_VECTOR_INL_HPP
#else
#define POINTFLIGHT_VEHICLE_VECTOR_INL_HPP
#endif

#include "pointflight/geometry/types.hpp"
#include "pointflight/vehicle/internal/number-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace pointflight::HWY_NAMESPACE {

template <class N>
struct Vec3 {
  N x, y, z;
};

/// The same in all lanes.
template <class N>
HWY_INLINE Vec3<N> all_of(const Vector3d& v) {
  return {N(v.x()), N(v.y()), N(v.z())};
}
template <class N>
HWY_INLINE Vec3<N> operator+(const Vec3<N>& a, const Vec3<N>& b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
template <class N>
HWY_INLINE Vec3<N> operator-(const Vec3<N>& a, const Vec3<N>& b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
template <class N>
HWY_INLINE Vec3<N> operator-(const Vec3<N>& a) {
  return {-a.x, -a.y, -a.z};
}
template <class N>
HWY_INLINE Vec3<N> operator*(N s, const Vec3<N>& a) {
  return {s * a.x, s * a.y, s * a.z};
}
template <class N>
HWY_INLINE Vec3<N> operator/(const Vec3<N>& a, N s) {
  return {a.x / s, a.y / s, a.z / s};
}
/// Component by component.
///@{
template <class N>
HWY_INLINE Vec3<N> times(const Vec3<N>& a, const Vec3<N>& b) {
  return {a.x * b.x, a.y * b.y, a.z * b.z};
}
template <class N>
HWY_INLINE Vec3<N> by(const Vec3<N>& a, const Vec3<N>& b) {
  return {a.x / b.x, a.y / b.y, a.z / b.z};
}
template <class N, class Mask>
HWY_INLINE Vec3<N> choose(Mask condition, const Vec3<N>& a, const Vec3<N>& b) {
  return {choose(condition, a.x, b.x), choose(condition, a.y, b.y), choose(condition, a.z, b.z)};
}
///@}
template <class N>
HWY_INLINE N dot(const Vec3<N>& a, const Vec3<N>& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
template <class N>
HWY_INLINE Vec3<N> cross(const Vec3<N>& a, const Vec3<N>& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
template <class N>
HWY_INLINE N norm(const Vec3<N>& a) {
  return root(dot(a, a));
}

/// Body axes in the world, mostly.
template <class N>
struct Quat {
  N x, y, z, w;
};

/// Component by component: what integrators do.
///@{
template <class N>
HWY_INLINE Quat<N> operator+(const Quat<N>& a, const Quat<N>& b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z, a.w + b.w};
}
template <class N>
HWY_INLINE Quat<N> operator*(N s, const Quat<N>& a) {
  return {s * a.x, s * a.y, s * a.z, s * a.w};
}
///@}

template <class N>
HWY_INLINE Quat<N> conjugate(const Quat<N>& q) {
  return {-q.x, -q.y, -q.z, q.w};
}
/// Of a unit quaternion.
template <class N>
HWY_INLINE Vec3<N> rotate(const Quat<N>& q, const Vec3<N>& v) {
  const Vec3<N> axis{q.x, q.y, q.z};
  Vec3<N> uv = cross(axis, v);
  uv = uv + uv;
  return (v + q.w * uv) + cross(axis, uv);
}
template <class N>
HWY_INLINE Quat<N> operator*(const Quat<N>& a, const Quat<N>& b) {
  return {(a.w * b.x + a.y * b.z) - (a.z * b.y - a.x * b.w),
          (a.w * b.y + a.y * b.w) + (a.z * b.x - a.x * b.z),
          (a.w * b.z - a.y * b.x) + (a.z * b.w + a.x * b.y),
          (a.w * b.w - a.y * b.y) - (a.z * b.z + a.x * b.x)};
}
/// As it is where it is zero.
template <class N>
HWY_INLINE Quat<N> normalized(const Quat<N>& q) {
  const N square = (q.x * q.x + q.z * q.z) + (q.y * q.y + q.w * q.w);
  const auto fine = square > N(0.0);
  const N length = choose(fine, root(square), N(1.0));
  return {q.x / length, q.y / length, q.z / length, q.w / length};
}

/// By columns: x, y and z axis of the body in the world.
template <class N>
struct Mat3 {
  Vec3<N> x, y, z;
};

template <class N>
HWY_INLINE Mat3<N> matrix_of(const Quat<N>& q) {
  const N tx = N(2.0) * q.x;
  const N ty = N(2.0) * q.y;
  const N tz = N(2.0) * q.z;
  const N twx = tx * q.w;
  const N twy = ty * q.w;
  const N twz = tz * q.w;
  const N txx = tx * q.x;
  const N txy = ty * q.x;
  const N txz = tz * q.x;
  const N tyy = ty * q.y;
  const N tyz = tz * q.y;
  const N tzz = tz * q.z;
  return {{N(1.0) - (tyy + tzz), txy + twz, txz - twy},
          {txy - twz, N(1.0) - (txx + tzz), tyz + twx},
          {txz + twy, tyz - twx, N(1.0) - (txx + tyy)}};
}
/// From the world into the body.
template <class N>
HWY_INLINE Vec3<N> into(const Mat3<N>& m, const Vec3<N>& v) {
  return {m.x.x * v.x + m.x.y * v.y + m.x.z * v.z,
          m.y.x * v.x + m.y.y * v.y + m.y.z * v.z,
          m.z.x * v.x + m.z.y * v.y + m.z.z * v.z};
}
/// From the body into the world.
template <class N>
HWY_INLINE Vec3<N> out_of(const Mat3<N>& m, const Vec3<N>& v) {
  return {m.x.x * v.x + m.y.x * v.y + m.z.x * v.z,
          m.x.y * v.x + m.y.y * v.y + m.z.y * v.z,
          m.x.z * v.x + (m.y.z * v.y + m.z.z * v.z)};
}

}  // namespace pointflight::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
