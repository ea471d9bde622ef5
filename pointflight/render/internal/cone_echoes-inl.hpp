// The echoes of a wide beam: what its sub-rays hit, by the light that comes back.
//
// Included once a target by Highway's foreach_target; see cone_kernel.cpp.
#if defined(POINTFLIGHT_RENDER_CONE_ECHOES_INL_HPP) == defined(HWY_TARGET_TOGGLE)
#ifdef POINTFLIGHT_RENDER_CONE_ECHOES_INL_HPP
#undef POINTFLIGHT_RENDER_CONE_ECHOES_INL_HPP
#else
#define POINTFLIGHT_RENDER_CONE_ECHOES_INL_HPP
#endif

#include "pointflight/map/surfel_map.hpp"
#include "pointflight/render/internal/cone_strips-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace pointflight::HWY_NAMESPACE {

inline constexpr std::size_t kMostSubRays = kLevelSizes[kSubRayLevels - 1];

/// What a beam's sub-rays hit and give back, eight by eight.
struct BeamParts {
  std::size_t eights;
  const SubRayLanes* sub_rays;
  SubRayHits hits[kMostSubRays / 8];
  alignas(32) float light[kMostSubRays / 8][8];      ///< Share of the beam's times reflectivity.
  alignas(32) float energy[kMostSubRays / 8][8];     ///< The same by 1 / range^2.
  alignas(32) float intensity[kMostSubRays / 8][8];  ///< The map's.
};

/// What the surfaces give back that eight sub-rays hit; `intensity` is written.
POINTFLIGHT_INLINE F8 reflectivities_of(const SurfelMap& surfels,
                                        const Reflectances& r,
                                        const SubRayHits& hits,
                                        float (&intensity)[8]) {
  F8 reflectivity = splat(r.same);
  if (surfels.has_intensity()) {
    for (std::size_t i = 0; i < 8; ++i) {
      intensity[i] = surfels.intensity(static_cast<std::uint32_t>(hits.word[i]));
    }
  } else {
    store(splat(0.0f), intensity);
  }
  if (r.per_intensity > 0.0f) {
    reflectivity = load(intensity) * splat(r.per_intensity);
  } else if (r.same <= 0.0f) {
    reflectivity = look_up(r.usual, right<20>(as_bits(load(hits.word)) * splat_bits(kUsualFactor)));
  }
  return max(splat(r.least), reflectivity * load(hits.cosine));
}

/// What the parts give back.
POINTFLIGHT_INLINE void light_up(const SurfelMap& surfels,
                                 const Reflectances& reflectances,
                                 BeamParts& parts) {
  for (std::size_t k = 0; k < parts.eights; ++k) {
    const SubRayHits& hits = parts.hits[k];
    const F8 range = load(hits.range);
    const M8 hit = range < splat(kNever);
    const F8 reflectivity = reflectivities_of(surfels, reflectances, hits, parts.intensity[k]);
    const F8 light = select(hit, load(parts.sub_rays[k].share) * reflectivity, splat(0.0f));
    const F8 near = max(range, splat(kNearestEcho));
    store(light, parts.light[k]);
    store(select(hit, light / (near * near), splat(0.0f)), parts.energy[k]);
  }
}

/// Sums over an echo's parts, in lanes, and in each lane the part that gives most.
struct EchoSums {  // NOLINT(cppcoreguidelines-pro-type-member-init): all is written
  F8 energy, range, light, intensity;
  F8 most, cosine;
  I8 word, number;
};

/// The echo whose parts, `count` of them from `nearest` to `farthest` (m), have these sums.
POINTFLIGHT_INLINE Echo echo_of(const EchoSums& sums,
                                std::size_t count,
                                float nearest,
                                float farthest) {
  alignas(32) float most[8];
  alignas(32) float cosine[8];
  alignas(32) std::int32_t word[8];
  alignas(32) std::int32_t number[8];
  store(sums.most, most);
  store(sums.cosine, cosine);
  store(sums.word, word);
  store(sums.number, number);
  // the first of those that give most
  const auto lane =
      static_cast<std::size_t>(std::countr_zero(bits(splat(greatest(sums.most)) <= sums.most)));
  const float energy = sum(sums.energy);
  Echo echo;
  echo.range = sum(sums.range) / energy;
  echo.reflectivity = sum(sums.light);
  echo.intensity = sum(sums.intensity) / energy;
  echo.parts = static_cast<std::uint16_t>(count);
  echo.depth = farthest - nearest;
  echo.origin = {cosine[lane],
                 static_cast<std::uint32_t>(word[lane]),
                 static_cast<std::uint16_t>(static_cast<std::size_t>(number[lane]) * 8 + lane)};
  return echo;
}

/// Eight sub-rays that all hit one surface as one echo.
POINTFLIGHT_INLINE Echo echo_of_eight(const SurfelMap& surfels,
                                      const Reflectances& reflectances,
                                      const SubRayLanes& sub_rays,
                                      const SubRayHits& hits) {
  alignas(32) float intensity[8];
  const F8 range = load(hits.range);
  const F8 light = load(sub_rays.share) * reflectivities_of(surfels, reflectances, hits, intensity);
  const F8 near = max(range, splat(kNearestEcho));
  const F8 energy = light / (near * near);
  const EchoSums sums = {energy,
                         energy * range,
                         light,
                         energy * load(intensity),
                         energy,
                         load(hits.cosine),
                         load(hits.word),
                         splat_int(0)};
  return echo_of(sums, 8, least(range), greatest(range));
}

/// The parts from `nearest` to `farthest` (m) as one echo.
POINTFLIGHT_INLINE Echo echo_within(const BeamParts& parts, float nearest, float farthest) {
  const F8 zero = splat(0.0f);
  EchoSums sums = {zero, zero, zero, zero, splat(-1.0f), zero, splat_int(0), splat_int(0)};
  std::size_t count = 0;
  for (std::size_t k = 0; k < parts.eights; ++k) {
    const SubRayHits& hits = parts.hits[k];
    const F8 range = load(hits.range);
    const M8 in = (splat(nearest) <= range) & (range <= splat(farthest));
    const F8 energy = select(in, load(parts.energy[k]), zero);
    sums.energy = sums.energy + energy;
    sums.range = sums.range + energy * select(in, range, zero);
    sums.light = sums.light + select(in, load(parts.light[k]), zero);
    sums.intensity = sums.intensity + energy * load(parts.intensity[k]);
    const M8 larger = (sums.most < energy) & in;
    sums.most = select(larger, energy, sums.most);
    sums.cosine = select(larger, load(hits.cosine), sums.cosine);
    sums.word = select(larger, load(hits.word), sums.word);
    sums.number = select(larger, splat_int(static_cast<std::int32_t>(k)), sums.number);
    count += static_cast<std::size_t>(std::popcount(bits(in)));
  }
  return echo_of(sums, count, nearest, farthest);
}

/// The range of the nearest part behind `behind`, kNever if there is none.
POINTFLIGHT_INLINE float nearest_behind(const BeamParts& parts, float behind) {
  F8 nearest = splat(kNever);
  for (std::size_t k = 0; k < parts.eights; ++k) {
    const F8 r = load(parts.hits[k].range);
    nearest = min(nearest, select(splat(behind) < r, r, splat(kNever)));
  }
  return least(nearest);
}

/// How far the pulse reaches that begins at `nearest`: from part to part no farther than `merge`.
POINTFLIGHT_INLINE float end_of_pulse(const BeamParts& parts, float nearest, float merge) {
  float end = nearest;
  while (true) {
    F8 farthest = splat(end);
    for (std::size_t k = 0; k < parts.eights; ++k) {
      const F8 r = load(parts.hits[k].range);
      farthest = max(farthest, select(r <= splat(end + merge), r, splat(0.0f)));
    }
    const float now = greatest(farthest);
    if (now == end) return end;
    end = now;
  }
}

/// The parts as the receiver tells them apart: `echoes_of` of echoes.hpp.
static HWY_NOINLINE void make_echoes(const BeamParts& parts, float merge, Echoes& echoes) {
  echoes.count = 0;
  echoes.all_hit = true;
  for (std::size_t k = 0; k < parts.eights; ++k) {
    echoes.all_hit = echoes.all_hit && greatest(load(parts.hits[k].range)) < kNever;
  }
  for (float end = -1.0f;;) {
    const float nearest = nearest_behind(parts, end);
    if (nearest == kNever) return;
    end = end_of_pulse(parts, nearest, merge);
    add_echo(echo_within(parts, nearest, end), echoes);
  }
}

/// True if eight sub-rays hit one plane: there the inverse of the range is linear across the beam.
POINTFLIGHT_INLINE bool lie_in_plane(const SubRayLanes& sub_rays, const SubRayHits& hits) {
  constexpr float kOffPlane = 0.2f;  // m
  const F8 range = load(hits.range);
  const F8 x = load(sub_rays.x);
  const F8 y = load(sub_rays.y);
  const F8 one = splat(1.0f);
  const F8 inverse = one / max(range, splat(kNearestEcho));
  // the same in y, and none in x y: positions on a circle
  const float per_xx = 1.0f / sum(x * x);
  const F8 fitted = splat(0.125f * sum(inverse)) + splat(sum(inverse * x) * per_xx) * x +
                    splat(sum(inverse * y) * per_xx) * y;
  const M8 close = (splat(0.0f) < fitted) & (abs(one / fitted - range) <= splat(kOffPlane));
  return bits(close) == 0xffu;
}

}  // namespace pointflight::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
