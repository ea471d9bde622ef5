// Wide beams on their way down the tree together: their frames, and the lists of surfels that their
// cross-sections touch.
//
// Included once a target by Highway's foreach_target; see cone_kernel.cpp.
#if defined(POINTFLIGHT_RENDER_CONE_LIST_INL_HPP) == defined(HWY_TARGET_TOGGLE)
#ifdef POINTFLIGHT_RENDER_CONE_LIST_INL_HPP
#undef POINTFLIGHT_RENDER_CONE_LIST_INL_HPP
#else
#define POINTFLIGHT_RENDER_CONE_LIST_INL_HPP
#endif

#include "pointflight/render/internal/bundle-inl.hpp"
#include "pointflight/render/internal/sub_rays.hpp"
#include "pointflight/render/wide_beams.hpp"

HWY_BEFORE_NAMESPACE();
namespace pointflight::HWY_NAMESPACE {

/// How far from its axis a beam is looked at, sigmas: just beyond the outermost sub-ray.
inline constexpr float kConeRadius = kSubRayRadius + 0.01f;
/// Surfels in the list of a beam that goes together with others.
inline constexpr std::size_t kMostTogether = 1000;
/// Surfels in the list of a beam that goes alone.
inline constexpr std::size_t kMostAlone = 8000;

/// Surfels of a leaf as a beam sees them, a lane each. Of a sub-ray (u, v) beside the axis
/// (`ConeBeam`) m^2 is quadratic in u and v, if directions within the beam are taken as parallel,
/// and the inverse of its depth, as a plane's is, linear.
struct ConeBlock {
  alignas(32) float m2[6][8];       ///< Of 1, u, v, u^2, u v, v^2.
  alignas(32) float inverse[3][8];  ///< Of 1, u, v; 1/m.
  alignas(32) float cosine[8];      ///< |e0 . d|, in whole steps.
  alignas(32) float nearest[8];     ///< No ray touches it at a greater inverse depth, 1/m.
  alignas(32) float solid[8];       ///< 1: the beam touches more than its fringe; else 0.
  alignas(32) float word[8];        ///< Its number in the map, as bits.
};

/// The surfels that a beam touches.
struct ConeList {
  std::size_t count;
  float* at;  ///< Each one's lane in the pool, counted in floats, as bits.
};

/// One of them: a lane of a block.
struct ConeSurfel {
  const float* lane;

  [[nodiscard]] POINTFLIGHT_INLINE float m2(std::size_t k) const { return lane[8 * k]; }
  [[nodiscard]] POINTFLIGHT_INLINE float inverse(std::size_t k) const { return lane[8 * (6 + k)]; }
  [[nodiscard]] POINTFLIGHT_INLINE float cosine() const { return lane[8 * 9]; }
  [[nodiscard]] POINTFLIGHT_INLINE float nearest() const { return lane[8 * 10]; }
  [[nodiscard]] POINTFLIGHT_INLINE float solid() const { return lane[8 * 11]; }
  [[nodiscard]] POINTFLIGHT_INLINE float word() const { return lane[8 * 12]; }
};
inline constexpr std::size_t kBlockFloats = sizeof(ConeBlock) / sizeof(float);

/// Numbers of a beam that lanes of pairs want.
enum BeamNumber : std::uint8_t {
  kAtU,
  kAtV,     ///< Of the axis, at depth 1.
  kHalfUU,  ///< Half its variances there,
  kUV,      ///< and its covariance.
  kHalfVV,
  kDet,  ///< Of the covariance.
  kWideU,
  kWideV,      ///< Half the beam.
  kPerLength,  ///< 1 / length of the axis to depth 1.
  kDeepest,    ///< Depth of its end, m.
  kBeamNumbers
};

/// Pairs of a beam and a surfel of one leaf that it may touch, one after the other, and whether it
/// does.
struct ConePairs {
  static constexpr std::size_t kMost = 8 * kTogether + 8;
  std::size_t count;
  // of the surfel
  alignas(32) float u[kMost], v[kMost], depth[kMost], lane[kMost];
  // of the beam
  alignas(32) float beam[kBeamNumbers][kMost];
  // of both
  alignas(32) float weight[kMost];   ///< On the axis.
  alignas(32) float reached[kMost];  ///< Depth, 0 if it is not touched.
  alignas(32) float address[kMost];  ///< Lane in the pool, counted in floats, as bits.
  std::uint8_t touched[kMost / 8 + 1];
};

/// What eight sub-rays hit.
struct SubRayHits {
  alignas(32) float range[8];  ///< m; kNever: nothing.
  alignas(32) float cosine[8];
  alignas(32) std::int32_t word[8];  ///< Of the surfel with the largest weight.
};

/// A wide beam on its way. Its frame has the map's axes: w is the one that its direction is closest
/// to, forwards, and u and v are the others; positions across it are u and v at depth w = 1.
struct ConeBeam {
  SubRayHits eight;    ///< Of the first level, as of the last look.
  int u, v, w;         ///< Axes of the map.
  float forward;       ///< 1, or -1 if it goes against the map's w.
  float direction[3];  ///< In u, v, w.
  float across[3];     ///< One sigma, rad: axes of the cross-section, turned,
  float up[3];         ///< in u, v, w.
  float length;        ///< Of it to depth 1.
  float shortest;      ///< Of any ray within the beam, to depth 1.
  float numbers[kBeamNumbers];
  float end;           ///< Nothing beyond counts, m.
  float far;           ///< Depth of what the list holds, m.
  float cover;         ///< Of the axis, since the last look.
  std::size_t looked;  ///< Surfels that the last look knew.
  std::uint32_t ray;
  bool failed;  ///< More surfels than the list has room for.
  ConeList list;
};

/// Wide beams on their way down together. They all look along one axis of the map, and their frame
/// is the bundle's; the ends of groups are depths in it.
struct ConeBundle : BundleWay {
  alignas(32) float look_behind[kGroups][8];  ///< Time to look when a way has come so deep, m.
  float first_look;                           ///< None of these is less.
  ConeBeam beams[kTogether];
  ConePairs pairs;
  std::size_t most;  ///< Surfels in a list.
  float lists[kTogether * (kMostTogether + 8)];
  std::size_t used;  ///< Of the pool.
  ConeBlock pool[kTogether * kMostTogether];
};
static_assert(kMostAlone + 8 <= kTogether * (kMostTogether + 8));

POINTFLIGHT_INLINE ConeSurfel surfel_at(const ConeBundle& b, const ConeList& list, std::size_t i) {
  return {&b.pool[0].m2[0][0] + std::bit_cast<std::uint32_t>(list.at[i])};
}

/// Where one sigma along each axis of a beam's section lies at depth 1, from the beam's axis.
struct BeamSection {
  float a_u, a_v;  ///< Along `across`.
  float b_u, b_v;  ///< Along `up`.

  [[nodiscard]] POINTFLIGHT_INLINE float det() const { return a_u * b_v - a_v * b_u; }
};

POINTFLIGHT_INLINE BeamSection section_of(const ConeBeam& beam) {
  const float at_u = beam.numbers[kAtU];
  const float at_v = beam.numbers[kAtV];
  return {(beam.across[0] - at_u * beam.across[2]) * beam.length,
          (beam.across[1] - at_v * beam.across[2]) * beam.length,
          (beam.up[0] - at_u * beam.up[2]) * beam.length,
          (beam.up[1] - at_v * beam.up[2]) * beam.length};
}

/// A direction of the map: along an axis, forwards or backwards.
struct MapAxis {
  int axis;
  float forward;  ///< 1 or -1.

  bool operator==(const MapAxis&) const = default;
};

/// The one that a direction is closest to.
POINTFLIGHT_INLINE MapAxis axis_of(const float (&direction)[3]) {
  const float x = std::abs(direction[0]);
  const float y = std::abs(direction[1]);
  const float z = std::abs(direction[2]);
  const int axis = z >= x && z >= y ? 2 : y >= x ? 1 : 0;
  return {axis, direction[axis] < 0.0f ? -1.0f : 1.0f};
}

/// The frame of a beam and its cross-section in it.
POINTFLIGHT_INLINE void set_up_frame(const float (&direction)[3],
                                     const float (&across)[3],
                                     const float (&up)[3],
                                     ConeBeam& beam) {
  const MapAxis axis = axis_of(direction);
  beam.w = axis.axis;
  beam.u = (beam.w + 1) % 3;
  beam.v = (beam.w + 2) % 3;
  beam.forward = axis.forward;
  const auto turned = [&](const float(&from)[3], float(&to)[3]) {
    to[0] = from[beam.u];
    to[1] = from[beam.v];
    to[2] = beam.forward * from[beam.w];
  };
  turned(direction, beam.direction);
  turned(across, beam.across);
  turned(up, beam.up);
  beam.length = 1.0f / beam.direction[2];
  beam.numbers[kAtU] = beam.direction[0] * beam.length;
  beam.numbers[kAtV] = beam.direction[1] * beam.length;
  const BeamSection section = section_of(beam);
  const float uu = section.a_u * section.a_u + section.b_u * section.b_u;
  const float vv = section.a_v * section.a_v + section.b_v * section.b_v;
  const float det = section.det();
  beam.numbers[kHalfUU] = 0.5f * uu;
  beam.numbers[kUV] = section.a_u * section.a_v + section.b_u * section.b_v;
  beam.numbers[kHalfVV] = 0.5f * vv;
  beam.numbers[kDet] = det * det;
  beam.numbers[kWideU] = kConeRadius * std::sqrt(uu);
  beam.numbers[kWideV] = kConeRadius * std::sqrt(vv);
  beam.numbers[kPerLength] = beam.direction[2];
  const float least_u = std::max(0.0f, std::abs(beam.numbers[kAtU]) - beam.numbers[kWideU]);
  const float least_v = std::max(0.0f, std::abs(beam.numbers[kAtV]) - beam.numbers[kWideV]);
  beam.shortest = std::sqrt(1.0f + (least_u * least_u + least_v * least_v));
}

/// Nothing beyond `end` (m) counts any more.
POINTFLIGHT_INLINE void end_at(float end, ConeBeam& beam) {
  beam.end = end;
  beam.numbers[kDeepest] = end / beam.shortest;
}

/// The frames of eight beams and the axes of their cross-sections, turned as their sub-rays are,
/// into `b.beams`.
POINTFLIGHT_INLINE void set_up_sections(const WideBeams& wide,
                                        ConeBundle& b,
                                        std::size_t g,
                                        const std::uint32_t* rays) {
  alignas(32) float wide_along[3][8];
  alignas(32) float cosines[8];
  alignas(32) float sines[8];
  for (std::size_t i = 0; i < 8; ++i) {
    const Vector3f& across = wide.across[rays[i]];
    for (int k = 0; k < 3; ++k) wide_along[k][i] = across[k];
    const Turn turn = turn_of(rays[i]);
    cosines[i] = turn.cosine;
    sines[i] = turn.sine;
  }
  const Group& group = b.groups[g];
  const F8 dx = load(group.dx);
  const F8 dy = load(group.dy);
  const F8 dz = load(group.dz);
  const F8 x = load(wide_along[0]);
  const F8 y = load(wide_along[1]);
  const F8 z = load(wide_along[2]);
  const F8 c = load(cosines);
  const F8 s = load(sines);
  const F8 wide_across = splat(wide.sigma_across);
  const F8 wide_up = splat(wide.sigma_up);
  const F8 up[3] = {dy * z - dz * y, dz * x - dx * z, dx * y - dy * x};
  const F8 from[3] = {x, y, z};
  alignas(32) float axes[2][3][8];
  for (int k = 0; k < 3; ++k) {
    const F8 along = wide_across * from[k];
    const F8 upward = wide_up * up[k];
    store(c * along + s * upward, axes[0][k]);
    store(c * upward - s * along, axes[1][k]);
  }
  for (std::size_t i = 0; i < 8; ++i) {
    ConeBeam& beam = b.beams[8 * g + i];
    const float direction[3] = {group.dx[i], group.dy[i], group.dz[i]};
    const float first[3] = {axes[0][0][i], axes[0][1][i], axes[0][2][i]};
    const float second[3] = {axes[1][0][i], axes[1][1][i], axes[1][2][i]};
    set_up_frame(direction, first, second, beam);
  }
}

/// Sets up a bundle of the first `count` groups; `rays[g]` are those of group g, which look along
/// one axis of the map. A list has room for `most` surfels.
///
/// In the frame of its beams a bundle enters all boxes that hold surfels which the rectangle of
/// `may_touch` admits: the interval of u / w that a box spans, wider by the beam at its far end, is
/// what that rectangle asks for of the surfel's own box, and grows with the box. So which surfels a
/// beam touches does not depend on the beams that it goes with.
POINTFLIGHT_INLINE void set_up_cones(const KernelMap& map,
                                     const WideBeams& wide,
                                     ConeBundle& b,
                                     std::size_t count,
                                     const std::uint32_t* const* rays,
                                     std::size_t most) {
  for (std::size_t g = 0; g < count; ++g) {
    for (std::size_t i = 0; i < 8; ++i) hwy::Prefetch(&wide.across[rays[g][i]]);
  }
  set_up_groups(map, b, count);
  for (std::size_t g = 0; g < count; ++g) set_up_sections(wide, b, g, rays[g]);
  const ConeBeam& first = b.beams[0];
  set_up_frustum(
      b, Vector3f::Unit(first.u), Vector3f::Unit(first.v), first.forward * Vector3f::Unit(first.w));
  set_up_way(b);
  b.used = 0;
  b.most = most;
  b.first_look = kNever;
  float wide_u = 0.0f;
  float wide_v = 0.0f;
  for (std::size_t g = 0; g < count; ++g) {
    store(splat(kNever), b.look_behind[g]);
    for (std::size_t i = 0; i < 8; ++i) {
      const std::size_t n = 8 * g + i;
      ConeBeam& beam = b.beams[n];
      wide_u = std::max(wide_u, beam.numbers[kWideU]);
      wide_v = std::max(wide_v, beam.numbers[kWideV]);
      end_at(b.groups[g].end[i], beam);
      b.groups[g].end[i] = beam.numbers[kDeepest];
      beam.far = 0.0f;
      beam.cover = 0.0f;
      beam.looked = 0;
      // one that goes alone is the first, and has all the room
      beam.list = {0, b.lists + n * (kMostTogether + 8)};
      beam.ray = rays[g][i];
      beam.failed = false;
    }
    b.group_end[g] = greatest(load(b.groups[g].end));
  }
  b.end = greatest(load(b.group_end));
  widen(b, wide_u, wide_v);
}

}  // namespace pointflight::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
