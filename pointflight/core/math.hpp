#pragma once

#include <sleef.h>

/// Transcendental functions that give the same bits on every CPU.
///
/// glibc picks other code for sin, cos, exp, ... when it finds FMA or AVX2, and a few results in
/// 10,000 differ. SLEEF's "cinz" functions are consistent across vector lengths and use no FMA. On
/// the path from seed to output only these (and sqrt, which IEEE 754 fixes) are allowed; a check in
/// tools/check_source.sh holds it. All within 1.0 ULP.
namespace pointflight::math {

/// Of `x` in radians.
inline double sin(double x) {
  return Sleef_cinz_sind1_u10purec(x);
}
/// Of `x` in radians.
inline double cos(double x) {
  return Sleef_cinz_cosd1_u10purec(x);
}
/// Of `x` in radians.
inline double tan(double x) {
  return Sleef_cinz_tand1_u10purec(x);
}
/// Radians, -pi/2 to pi/2; NaN outside [-1, 1].
inline double asin(double x) {
  return Sleef_cinz_asind1_u10purec(x);
}
/// Radians, 0 to pi; NaN outside [-1, 1].
inline double acos(double x) {
  return Sleef_cinz_acosd1_u10purec(x);
}
/// Angle of (x, y) from the x axis, radians, -pi to pi.
inline double atan2(double y, double x) {
  return Sleef_cinz_atan2d1_u10purec(y, x);
}
/// Infinity if it overflows, 0 if it underflows.
inline double exp(double x) {
  return Sleef_cinz_expd1_u10purec(x);
}
/// Natural logarithm.
inline double log(double x) {
  return Sleef_cinz_logd1_u10purec(x);
}
/// As std::pow, special cases included.
inline double pow(double x, double y) {
  return Sleef_cinz_powd1_u10purec(x, y);
}

inline constexpr double kHalfRoot = 0.70710678118654752440;  ///< 1 / sqrt(2)

/// Probability that a standard normal lies below `x`; within 1.5 ULP of the true one's tail.
inline double normal_probability(double x) {
  return 0.5 * Sleef_cinz_erfcd1_u15purec(-x * kHalfRoot);
}
/// Where `normal_probability` is `p`, 0 < p < 1, to 1e-14; for set-up, not for each beam.
double normal_quantile(double p);

/// Of one angle.
struct SinCos {
  double sin;  ///< -1 to 1
  double cos;  ///< -1 to 1
};
/// Both of `x` in radians, for the price of one.
inline SinCos sincos(double x) {
  const auto both = Sleef_cinz_sincosd1_u10purec(x);
  return {both.x, both.y};
}

}  // namespace pointflight::math
