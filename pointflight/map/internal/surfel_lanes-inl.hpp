// Surfels of a leaf decoded eight at a time: what rays and distances share.
//
// Included once a target by Highway's foreach_target; see nearest.cpp and
// render/internal/beam_kernel.cpp.
#if defined(POINTFLIGHT_MAP_SURFEL_LANES_INL_HPP) == defined(HWY_TARGET_TOGGLE)
#ifdef POINTFLIGHT_MAP_SURFEL_LANES_INL_HPP
#undef POINTFLIGHT_MAP_SURFEL_LANES_INL_HPP
#else
#define POINTFLIGHT_MAP_SURFEL_LANES_INL_HPP
#endif

#include "pointflight/core/internal/simd8-inl.hpp"
#include "pointflight/map/surfel_scale.hpp"

HWY_BEFORE_NAMESPACE();
namespace pointflight::HWY_NAMESPACE {

/// The surfels of a leaf, one a lane, decoded: what does not depend on the beam.
struct SurfelLanes {
  F8 x, y, z;    ///< Centre from the leaf's origin, m.
  F8 variance2;  ///< s2^2, m^2
  F8 widest;     ///< The largest variance: the surfel reaches M times its root.
  U8 low, high;
};

POINTFLIGHT_INLINE SurfelLanes load_surfels(const SurfelScale& scale, const SurfelWord* words) {
  SurfelLanes s;  // NOLINT(cppcoreguidelines-pro-type-member-init): all is written
  load_words(words, s.low, s.high);
  const F8 step = splat(scale.position_step);
  const F8 half = splat(0.5f);
  const U8 ten = splat_bits(1023u);
  s.x = (to_float(s.low & ten) + half) * step;
  s.y = (to_float(right<10>(s.low) & ten) + half) * step;
  s.z = (to_float(right<20>(s.low) & ten) + half) * step;
  const U8 code = right<27>(s.high) * splat_bits(0x288000u) + splat_bits(0x3b6bedfau);
  s.variance2 = as_float(code) * splat(scale.r_squared);
  s.widest = max(s.variance2, look_up4(scale.widest, right<30>(s.low)));
  return s;
}

/// S R: the axes as rows, each divided by its standard deviation; and s0, m.
struct Shapes {
  F8 m0x, m0y, m0z, m1x, m1y, m1z, m2x, m2y, m2z;
  F8 s0;
};

POINTFLIGHT_INLINE Shapes decode_shapes(const SurfelScale& scale, const SurfelLanes& s) {
  const F8 one = splat(1.0f);
  const F8 two = splat(2.0f);
  const F8 step = splat(0.70711f / 127.0f);
  const F8 qx = signed_top_byte(left<24>(s.high)) * step;
  const F8 qy = signed_top_byte(left<16>(s.high)) * step;
  const F8 qz = signed_top_byte(left<8>(s.high)) * step;
  const F8 xx = qx * qx;
  const F8 yy = qy * qy;
  const F8 zz = qz * qz;
  const F8 qw = sqrt(max(splat(0.0f), one - xx - yy - zz));
  const F8 xy = qx * qy;
  const F8 xz = qx * qz;
  const F8 yz = qy * qz;
  const F8 wx = qw * qx;
  const F8 wy = qw * qy;
  const F8 wz = qw * qz;
  const U8 thickness = right<30>(s.low);
  const F8 i0 = look_up4(scale.inverse_thickness, thickness);
  const F8 i2 = one / sqrt(s.variance2);
  const F8 i1 = i2 * look_up8(scale.inverse_ratio, right<24>(s.high) & splat_bits(7u));
  Shapes e;  // NOLINT(cppcoreguidelines-pro-type-member-init): all is written
  e.m0x = (one - two * (yy + zz)) * i0;
  e.m0y = two * (xy + wz) * i0;
  e.m0z = two * (xz - wy) * i0;
  e.m1x = two * (xy - wz) * i1;
  e.m1y = (one - two * (xx + zz)) * i1;
  e.m1z = two * (yz + wx) * i1;
  e.m2x = two * (xz + wy) * i2;
  e.m2y = two * (yz - wx) * i2;
  e.m2z = (one - two * (xx + yy)) * i2;
  e.s0 = look_up4(scale.thickness, thickness);
  return e;
}

}  // namespace pointflight::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
