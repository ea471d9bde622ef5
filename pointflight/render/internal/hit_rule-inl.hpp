// The hit rule for one beam and for eight: what a beam and a surfel have in common, and where the
// surface lies among the surfels that a beam has hit (docs/architecture.md, "Hit rule"). Single
// rays and packets both use it, so that their results are the same bits.
//
// Included once a target by Highway's foreach_target; see beam_kernel.cpp.
#if defined(POINTFLIGHT_RENDER_HIT_RULE_INL_HPP) == defined(HWY_TARGET_TOGGLE)
#ifdef POINTFLIGHT_RENDER_HIT_RULE_INL_HPP
#undef POINTFLIGHT_RENDER_HIT_RULE_INL_HPP
#else
#define POINTFLIGHT_RENDER_HIT_RULE_INL_HPP
#endif

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "pointflight/core/internal/simd8-inl.hpp"
#include "pointflight/map/internal/surfel_lanes-inl.hpp"
#include "pointflight/render/internal/beam_kernel.hpp"

HWY_BEFORE_NAMESPACE();
namespace pointflight::HWY_NAMESPACE {

/// A position in the frames of eight surfels, in their standard deviations.
struct Whitened {
  F8 x, y, z;
};

POINTFLIGHT_INLINE Whitened whiten(const Shapes& e, const F8& x, const F8& y, const F8& z) {
  return {e.m0x * x + e.m0y * y + e.m0z * z,
          e.m1x * x + e.m1y * y + e.m1z * z,
          e.m2x * x + e.m2y * y + e.m2z * z};
}

/// Of eight surfels along their axes, m^2.
struct Variances {
  F8 x, y, z;
};

POINTFLIGHT_INLINE Variances variances_of(const SurfelScale& scale,
                                          const SurfelLanes& surfels,
                                          const Shapes& e) {
  const F8 ratio = look_up8(scale.ratio, right<24>(surfels.high) & splat_bits(7u));
  return {e.s0 * e.s0, surfels.variance2 * ratio * ratio, surfels.variance2};
}

/// How far the supports of eight surfels reach along an axis n, of which `whitened` is S R n, m:
/// e.n is M |S^-1 R n| at most, and a little for rounding.
POINTFLIGHT_INLINE F8 reach_along(const KernelMap& map,
                                  const Variances& variances,
                                  const Whitened& whitened) {
  // whitening divides by deviations; times the variances
  const F8 x = whitened.x * variances.x;
  const F8 y = whitened.y * variances.y;
  const F8 z = whitened.z * variances.z;
  return sqrt((x * x + y * y + z * z) * splat(map.support_squared)) * splat(1.03f);
}

/// What the model says for eight pairs of a beam and a surfel: t = u.v / v.v, m^2 = |u - t v|^2
/// with u = S R (p - o) and v = S R d. In float u is exact to 2^-23 |p - o| / s: at 100 m, r = 0.05
/// m and the least s0 that is 0.05 standard deviations, at most 2 % of M.
struct Meeting {
  F8 t;
  F8 m2;
  F8 cosine;  ///< |e0 . d|
};

POINTFLIGHT_INLINE Meeting meet(const Whitened& u, const Whitened& v, const F8& s0) {
  Meeting result;  // NOLINT(cppcoreguidelines-pro-type-member-init): all is written
  result.t = (u.x * v.x + u.y * v.y + u.z * v.z) / (v.x * v.x + v.y * v.y + v.z * v.z);
  const F8 a0 = u.x - result.t * v.x;
  const F8 a1 = u.y - result.t * v.y;
  const F8 a2 = u.z - result.t * v.z;
  result.m2 = a0 * a0 + a1 * a1 + a2 * a2;
  result.cosine = abs(v.x) * s0;
  return result;
}

/// Weights c (1 - m^2 / M^2)^2 in whole steps; 0 outside the support, and where a corrupt map makes
/// m not a number.
POINTFLIGHT_INLINE I8 weights_of(const KernelMap& map, const F8& m2) {
  const F8 support = splat(map.support_squared);
  const F8 inside = select(m2 < support, m2, support);
  const F8 share = splat(1.0f) - inside * splat(map.inverse_support);
  return to_int(splat(map.weight_scale) * share * share);
}

inline constexpr float kNever = 3.0e38f;
/// Surfels that the list of one beam holds.
inline constexpr std::size_t kHits = 256;

/// Surfels that one beam has hit, in no order; lanes behind the last are never hit.
struct HitLanes {
  std::size_t count;
  std::int32_t total;  ///< Of the weights: below tau no surface can exist.
  float nearest;       ///< The least t.
  alignas(32) float t[kHits + 16];
  alignas(32) std::int32_t weight[kHits + 16];
  alignas(32) std::int32_t word[kHits + 16];
  alignas(32) float cosine[kHits + 16];  ///< |e0 . d|
};

/// The hit rule: the nearest hit a for which the weights within [t_a, t_a + window] reach tau.
/// Returns its t, or kNever.
POINTFLIGHT_INLINE float find_surface(const KernelMap& map, const HitLanes& hits) {
  float tried = -1.0f;
  while (true) {
    F8 nearest = splat(kNever);
    for (std::size_t i = 0; i < hits.count; i += 8) {
      const F8 t = load(hits.t + i);
      nearest = min(nearest, select(splat(tried) < t, t, splat(kNever)));
    }
    const float a = least(nearest);
    if (a == kNever) return kNever;
    std::int32_t weight = 0;
    const F8 begin = splat(a);
    const F8 end = splat(a + map.window);
    for (std::size_t i = 0; i < hits.count; i += 8) {
      const F8 t = load(hits.t + i);
      weight += sum(keep((begin <= t) & (t <= end), load(hits.weight + i)));
    }
    if (weight >= map.tau) return a;
    tried = a;
  }
}

/// Keeps the hits up to `limit`, `most` of them.
POINTFLIGHT_INLINE void keep_up_to(HitLanes& h, float limit, std::size_t most) {
  std::size_t kept = 0;
  h.total = 0;
  for (std::size_t i = 0; i < h.count && kept < most; ++i) {
    if (h.t[i] > limit) continue;
    h.t[kept] = h.t[i];
    h.weight[kept] = h.weight[i];
    h.word[kept] = h.word[i];
    h.cosine[kept] = h.cosine[i];
    h.total += h.weight[kept++];
  }
  h.count = kept;
  store_unaligned(splat(kNever), h.t + kept);
  store_unaligned(splat(kNever), h.t + kept + 8);
}

/// Room for eight more hits: forgets those behind the end, else the farther half. True if hits that
/// might have mattered are lost.
static HWY_NOINLINE bool make_room(HitLanes& h, float end) {
  keep_up_to(h, end, kHits);
  if (h.count + 8 <= kHits) return false;
  float sorted[kHits + 16];
  std::copy(h.t, h.t + h.count, sorted);
  std::nth_element(sorted, sorted + kHits / 2, sorted + h.count);
  // if most lie at one depth, any of them will do
  keep_up_to(h, sorted[kHits / 2], kHits - 8);
  return true;
}

/// Shares of a hit in the sums over the surface's window: whole numbers, so that no order shows,
/// and small enough that 128 full weights fit 32 bits (a group of a packet holds kRows).
struct Shares {
  I8 weight, depth, cosine;
};

POINTFLIGHT_INLINE Shares
shares_of(const KernelMap& map, const F8& first, const F8& t, const I8& weight, const F8& cosine) {
  const M8 inside = (first <= t) & (t <= first + splat(map.window));
  Shares s;  // NOLINT(cppcoreguidelines-pro-type-member-init): all is written
  s.weight = keep(inside, right<8>(weight));
  // lanes outside may be anything: they count nothing
  const F8 behind = select(inside, t - first, splat(0.0f));
  s.depth = s.weight * to_int(behind * splat(kShareSteps / map.window));
  const F8 turned = select(inside, cosine, splat(0.0f));
  s.cosine = s.weight * to_int(turned * splat(kShareSteps));
  return s;
}

POINTFLIGHT_INLINE KernelHit return_of(const KernelMap& map,
                                       float first,
                                       std::int64_t weight,
                                       std::int64_t depth,
                                       std::int64_t cosine,
                                       std::uint32_t strongest) {
  const float total = static_cast<float>(weight) * kShareSteps;
  KernelHit hit;
  hit.range = first + static_cast<float>(depth) / total * map.window;
  hit.cos_incidence = std::min(1.0f, static_cast<float>(cosine) / total);
  hit.strongest = strongest;
  return hit;
}

/// The return: weighted means over the window.
POINTFLIGHT_INLINE KernelHit return_of(const KernelMap& map, float surface, const HitLanes& hits) {
  if (surface == kNever) return {};
  const F8 first = splat(surface);
  // a full list can pass 32 bits; eight lanes of it cannot
  std::int64_t weight = 0;
  std::int64_t depth = 0;
  std::int64_t cosine = 0;
  std::int32_t largest = -1;
  std::uint32_t strongest = 0;
  for (std::size_t i = 0; i < hits.count; i += 8) {
    const Shares shares =
        shares_of(map, first, load(hits.t + i), load(hits.weight + i), load(hits.cosine + i));
    weight += sum(shares.weight);
    depth += sum(shares.depth);
    cosine += sum(shares.cosine);
  }
  const float end = surface + map.window;
  for (std::size_t i = 0; i < hits.count; ++i) {
    if (!(hits.t[i] >= surface) || !(hits.t[i] <= end)) continue;
    const auto word = static_cast<std::uint32_t>(hits.word[i]);
    const std::int32_t w = hits.weight[i];
    if (w > largest || (w == largest && word < strongest)) {
      largest = w;
      strongest = word;
    }
  }
  return return_of(map, surface, weight, depth, cosine, strongest);
}

}  // namespace pointflight::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
