// What the sub-rays of a wide beam hit: the hit rule for eight of them at once, over the beam's
// list of surfels (cone_list-inl.hpp).
//
// Included once a target by Highway's foreach_target; see cone_kernel.cpp.
#if defined(POINTFLIGHT_RENDER_CONE_HITS_INL_HPP) == defined(HWY_TARGET_TOGGLE)
#ifdef POINTFLIGHT_RENDER_CONE_HITS_INL_HPP
#undef POINTFLIGHT_RENDER_CONE_HITS_INL_HPP
#else
#define POINTFLIGHT_RENDER_CONE_HITS_INL_HPP
#endif

#include "pointflight/render/internal/cone_touch-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace pointflight::HWY_NAMESPACE {

/// What eight sub-rays have in common with the list's surfels: a row is one surfel, lanes that it
/// does not hit hold kNever and weight 0. The last row is written over by the next.
struct SubRayRows {  // NOLINT(cppcoreguidelines-pro-type-member-init): written before it is read
  std::size_t count;
  alignas(32) float t[kMostAlone + 1][8];
  alignas(32) float weight[kMostAlone + 1][8];
  ConeSurfel surfel[kMostAlone + 1];
  F8 nearest, farthest;  ///< Of all t that are hit.
  F8 total;              ///< Of the weights.
};

/// Eight sub-rays as a beam's frame has them.
struct SeenSubRays {  // NOLINT(cppcoreguidelines-pro-type-member-init): all is written
  F8 u, v;            ///< Beside the axis.
  F8 length;          ///< To depth 1.
};

POINTFLIGHT_INLINE SeenSubRays see(const ConeBeam& beam, const SubRayLanes& sub_rays) {
  const F8 x = load(sub_rays.x);
  const F8 y = load(sub_rays.y);
  const auto along = [&](int k) {
    return splat(beam.direction[k]) + (splat(beam.across[k]) * x + splat(beam.up[k]) * y);
  };
  const F8 per_depth = splat(1.0f) / along(2);
  const F8 u = along(0) * per_depth;
  const F8 v = along(1) * per_depth;
  return {u - splat(beam.numbers[kAtU]),
          v - splat(beam.numbers[kAtV]),
          sqrt(splat(1.0f) + (u * u + v * v))};
}

/// 1 / depth of eight sub-rays on a surfel.
POINTFLIGHT_INLINE F8 inverse_at(const ConeSurfel& surfel, const SeenSubRays& s) {
  return splat(surfel.inverse(0)) + splat(surfel.inverse(1)) * s.u + splat(surfel.inverse(2)) * s.v;
}

/// The surfels whose supports any of eight sub-rays hits, as rows; m^2 goes where the weights will.
POINTFLIGHT_INLINE void choose_rows(const KernelMap& map,
                                    const ConeBundle& b,
                                    const ConeList& list,
                                    const SeenSubRays& s,
                                    SubRayRows& rows) {
  const F8 uu = s.u * s.u;
  const F8 uv = s.u * s.v;
  const F8 vv = s.v * s.v;
  const F8 support = splat(map.support_squared);
  std::size_t n = 0;
  for (std::size_t i = 0; i < list.count; ++i) {
    const ConeSurfel surfel = surfel_at(b, list, i);
    const F8 m2 = splat(surfel.m2(0)) + (splat(surfel.m2(1)) * s.u + splat(surfel.m2(2)) * s.v) +
                  (splat(surfel.m2(3)) * uu + splat(surfel.m2(4)) * uv + splat(surfel.m2(5)) * vv);
    store(m2, rows.weight[n]);
    rows.surfel[n] = surfel;
    n += bits(m2 < support) != 0 ? 1 : 0;
  }
  rows.count = n;
}

/// The rows of eight sub-rays, up to `limit` (m).
POINTFLIGHT_INLINE void fill_rows(const KernelMap& map,
                                  const ConeBundle& b,
                                  const ConeList& list,
                                  const SeenSubRays& s,
                                  float limit,
                                  SubRayRows& rows) {
  choose_rows(map, b, list, s, rows);
  const F8 zero = splat(0.0f);
  const F8 never = splat(kNever);
  const F8 support = splat(map.support_squared);
  const F8 end = splat(limit);
  F8 nearest = never;
  F8 farthest = zero;
  F8 total = zero;
  const std::size_t count = rows.count;
  for (std::size_t i = 0; i < count; ++i) {
    const F8 m2 = load(rows.weight[i]);
    const F8 t = s.length / inverse_at(rows.surfel[i], s);
    const M8 hit = (m2 < support) & (zero < t) & (t <= end);
    const F8 weight = select(hit, soft_weights_of(map, m2), zero);
    const F8 at = select(hit, t, never);
    nearest = min(nearest, at);
    farthest = max(farthest, select(hit, t, zero));
    total = total + weight;
    store(at, rows.t[i]);
    store(weight, rows.weight[i]);
  }
  rows.nearest = nearest;
  rows.farthest = farthest;
  rows.total = total;
}

/// Where the surfaces begin, a lane each, by the hit rule.
POINTFLIGHT_INLINE F8 surfaces_of(const KernelMap& map, const SubRayRows& rows) {
  const F8 never = splat(kNever);
  const F8 zero = splat(0.0f);
  const F8 window = splat(map.window);
  const F8 tau = splat(static_cast<float>(map.tau) * (kWeightSteps / kWeightOne));
  // too little in all: no surface
  F8 tried = select(tau <= rows.total, rows.nearest, never);
  if (bits(rows.farthest <= rows.nearest + window) == 0xffu) return tried;
  F8 found = never;
  while (bits(tried < never) != 0) {
    const F8 end = tried + window;
    F8 next = never;
    F8 weight = zero;
    for (std::size_t i = 0; i < rows.count; ++i) {
      const F8 t = load(rows.t[i]);
      weight = weight + select((tried <= t) & (t <= end), load(rows.weight[i]), zero);
      next = min(next, select(tried < t, t, never));
    }
    const M8 covered = (tau <= weight) & (tried < never);
    found = select(covered, tried, found);
    tried = select(covered, never, next);
  }
  return found;
}

/// The returns of eight sub-rays: weighted means over the windows that begin at `first`.
POINTFLIGHT_INLINE void returns_of(const KernelMap& map,
                                   const SubRayRows& rows,
                                   const F8& first,
                                   SubRayHits& hits) {
  const F8 never = splat(kNever);
  const F8 zero = splat(0.0f);
  const F8 end = first + splat(map.window);
  const F8 step = splat(kDepthSteps / map.window);
  F8 total = zero;
  F8 depth = zero;
  F8 cosine = zero;
  F8 largest = splat(-1.0f);
  I8 strongest = splat_int(0);
  for (std::size_t i = 0; i < rows.count; ++i) {
    const F8 t = load(rows.t[i]);
    const M8 inside = (first <= t) & (t <= end);
    const F8 weight = select(inside, load(rows.weight[i]), zero);
    total = total + weight;
    depth = depth + select(inside, weight * rounded((t - first) * step), zero);
    cosine = cosine + weight * splat(rows.surfel[i].cosine());
    const I8 word = splat_int(std::bit_cast<std::int32_t>(rows.surfel[i].word()));
    const M8 larger = largest < weight;
    const M8 same = (largest <= weight) & (word < strongest);
    strongest = select(larger, word, select(same, word, strongest));
    largest = max(largest, weight);
  }
  const F8 per = splat(1.0f) / total;
  const F8 mean = first + depth * per * splat(map.window / kDepthSteps);
  const M8 hit = first < never;
  store(select(hit, mean, never), hits.range);
  // of nothing: any number
  store(select(hit, min(splat(1.0f), cosine * per * splat(1.0f / kCosineSteps)), zero),
        hits.cosine);
  store(strongest, hits.word);
}

/// What eight sub-rays hit of a list up to `limit`, m. Returns where the surfaces begin, which more
/// surfels can but bring nearer.
POINTFLIGHT_INLINE F8 hit_sub_rays(const KernelMap& map,
                                   const ConeBundle& b,
                                   const ConeList& list,
                                   const SeenSubRays& seen,
                                   float limit,
                                   SubRayRows& rows,
                                   SubRayHits& hits) {
  fill_rows(map, b, list, seen, limit, rows);
  const F8 first = surfaces_of(map, rows);
  if (bits(first < splat(kNever)) == 0) {
    store(splat(kNever), hits.range);
    store(splat(0.0f), hits.cosine);
    store(splat_int(0), hits.word);
    return first;
  }
  returns_of(map, rows, first, hits);
  return first;
}

/// True if a surfel that the beam touches lies in front of what its sub-rays hit, by more than
/// `before` (m) wherever they are across the beam: a wire may pass between them all.
POINTFLIGHT_INLINE bool has_before(const ConeBundle& b,
                                   const ConeBeam& beam,
                                   const SubRayLanes& sub_rays,
                                   const F8& hit,
                                   float before) {
  const SeenSubRays seen = see(beam, sub_rays);
  // nearer than nothing is anything
  const F8 limit = seen.length / max(splat(1e-3f), hit - splat(before));
  bool has = false;
  for (std::size_t i = 0; i < beam.list.count; ++i) {
    const ConeSurfel surfel = surfel_at(b, beam.list, i);
    const bool nearer = bits(limit < inverse_at(surfel, seen)) == 0xffu;
    has |= nearer & (surfel.solid() > 0.0f);
  }
  return has;
}

}  // namespace pointflight::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
