// Which surfels of a beam's list lie in which strip across it: eight sub-rays that lie in a strip
// look at those of it alone. Beams that graze the ground touch hundreds, each of which but few
// sub-rays hit.
//
// Included once a target by Highway's foreach_target; see cone_kernel.cpp.
#if defined(POINTFLIGHT_RENDER_CONE_STRIPS_INL_HPP) == defined(HWY_TARGET_TOGGLE)
#ifdef POINTFLIGHT_RENDER_CONE_STRIPS_INL_HPP
#undef POINTFLIGHT_RENDER_CONE_STRIPS_INL_HPP
#else
#define POINTFLIGHT_RENDER_CONE_STRIPS_INL_HPP
#endif

#include "pointflight/render/internal/cone_hits-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace pointflight::HWY_NAMESPACE {

/// With fewer surfels strips cost more than they save.
inline constexpr std::size_t kFewestForStrips = 32;

/// Where the surfels of a list lie along one direction across the beam, by their numbers there.
struct ConeStrips {  // NOLINT(cppcoreguidelines-pro-type-member-init): written before it is read
  float along_u, along_v;  ///< The direction: what to multiply u and v by, sigmas of the beam.
  alignas(32) float low[kMostAlone + 8], high[kMostAlone + 8];
  float places[kMostAlone + 8];
  ConeList part;  ///< Those of one strip, at `places`.
};

/// The direction, of `strip_directions`, along which the depth of what eight sub-rays hit changes
/// most: along it, surfels of a surface that the beam grazes are thin.
POINTFLIGHT_INLINE std::size_t direction_of_strips(const SubRayLanes& eight,
                                                   const SubRayHits& hits) {
  const F8 inverse = splat(1.0f) / max(load(hits.range), splat(1.0f));
  const F8 x = splat(sum(inverse * load(eight.x)));
  const F8 y = splat(sum(inverse * load(eight.y)));
  const StripDirections& directions = strip_directions();
  const F8 along = abs(x * load(directions.x) + y * load(directions.y));
  const std::uint32_t greatest_ones = bits(splat(greatest(along)) <= along);
  // of a corrupt map there may be none
  return static_cast<std::size_t>(std::countr_zero(greatest_ones | 0x80u));
}

/// Which of eight surfels of a list from `at` on there are.
POINTFLIGHT_INLINE std::uint32_t lanes_there(const ConeList& list, std::size_t at) {
  return list.count - at >= 8 ? 0xffu : (1u << (list.count - at)) - 1u;
}

/// Where the surfels of a beam lie along a direction of `strip_directions`.
POINTFLIGHT_INLINE void set_up_strips(const KernelMap& map,
                                      const ConeBundle& b,
                                      const ConeBeam& beam,
                                      std::size_t direction,
                                      ConeStrips& strips) {
  const BeamSection section = section_of(beam);
  const float per_det = 1.0f / section.det();
  const float x = strip_directions().x[direction];
  const float y = strip_directions().y[direction];
  strips.along_u = (x * section.b_v - y * section.a_v) * per_det;
  strips.along_v = (y * section.a_u - x * section.b_u) * per_det;
  const F8 along_u = splat(strips.along_u);
  const F8 along_v = splat(strips.along_v);
  const F8 half = splat(0.5f);
  const F8 far_away = splat(1e30f);
  for (std::size_t i = 0; i < beam.list.count; i += 8) {
    // behind the list's end is anything
    const M8 there = lanes_of(lanes_there(beam.list, i));
    const U8 lanes = as_bits(select(there, load_unaligned(beam.list.at + i), splat(0.0f)));
    const auto m2 = [&](std::size_t k) { return look_up(&b.pool[0].m2[0][0] + 8 * k, lanes); };
    const F8 u = m2(1);
    const F8 v = m2(2);
    const F8 uu = m2(3);
    const F8 uv = half * m2(4);
    const F8 vv = m2(5);
    const F8 det = uu * vv - uv * uv;
    // that of a needle which lies across the axes is lost in rounding: it may lie anywhere
    const M8 known = splat(1e-3f) * uu * vv <= det;
    const F8 per = splat(1.0f) / det;
    const F8 middle = half * per * (along_u * (uv * v - vv * u) + along_v * (uv * u - uu * v));
    const F8 reach =
        sqrt(splat(map.support_squared) * per *
             (vv * along_u * along_u - (uv + uv) * along_u * along_v + uu * along_v * along_v));
    const F8 room = splat(0.01f) * (splat(1.0f) + abs(middle) + reach);
    store(select(known, middle - reach - room, splat(-1e30f)), strips.low + i);
    store(select(known, middle + reach + room, far_away), strips.high + i);
  }
}

/// The surfels of the strip in which eight sub-rays lie, into `strips.part`.
POINTFLIGHT_INLINE void take_strip(const ConeList& list,
                                   const SeenSubRays& seen,
                                   ConeStrips& strips) {
  const F8 along = splat(strips.along_u) * seen.u + splat(strips.along_v) * seen.v;
  const F8 from = splat(least(along));
  const F8 to = splat(greatest(along));
  std::size_t count = 0;
  for (std::size_t i = 0; i < list.count; i += 8) {
    const std::uint32_t in =
        bits((from <= load(strips.high + i)) & (load(strips.low + i) <= to)) & lanes_there(list, i);
    store_unaligned(permuted(load_unaligned(list.at + i), chosen_lanes(in)), strips.places + count);
    count += static_cast<std::size_t>(std::popcount(in));
  }
  strips.part = {count, strips.places};
}

}  // namespace pointflight::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
