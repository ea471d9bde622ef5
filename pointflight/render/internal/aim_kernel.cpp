#include "pointflight/render/internal/aim_kernel.hpp"

#include <algorithm>

#include "pointflight/core/internal/simd_targets-inl.hpp"
// for foreach_target
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pointflight/render/internal/aim_kernel.cpp"
#include <hwy/foreach_target.h>
// after foreach_target
#include "pointflight/core/internal/simd8-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace pointflight::HWY_NAMESPACE {

struct AimVector {
  F8 x, y, z;
};

/// Rotations that are not normalised, and their |q|^2.
struct AimTurn {
  F8 x, y, z, w;
  F8 square;
};

/// 1 / sqrt(x) for 0.2 < x < 2, by Newton's iteration from 1 on.
POINTFLIGHT_INLINE F8 inverse_root_near_one(const F8& x) {
  const F8 half = splat(0.5f) * x;
  F8 y = splat(1.0f);
  for (int i = 0; i < 6; ++i) y = y * (splat(1.5f) - half * (y * y));
  return y;
}

/// 1 / x for 0.4 < x < 1.6, likewise.
POINTFLIGHT_INLINE F8 inverse_near_one(const F8& x) {
  F8 y = splat(1.0f);
  for (int i = 0; i < 5; ++i) y = y * (splat(2.0f) - x * y);
  return y;
}

POINTFLIGHT_INLINE AimVector normalized(const AimVector& v) {
  const F8 scale = inverse_root_near_one((v.x * v.x + v.y * v.y) + v.z * v.z);
  return {v.x * scale, v.y * scale, v.z * scale};
}

/// |q|^2 times R(q) v: v |q|^2 + w t + q x t with t = 2 q x v.
POINTFLIGHT_INLINE AimVector turned(const AimTurn& q, const AimVector& v) {
  const F8 two = splat(2.0f);
  const F8 tx = two * (q.y * v.z - q.z * v.y);
  const F8 ty = two * (q.z * v.x - q.x * v.z);
  const F8 tz = two * (q.x * v.y - q.y * v.x);
  return {(q.square * v.x + q.w * tx) + (q.y * tz - q.z * ty),
          (q.square * v.y + q.w * ty) + (q.z * tx - q.x * tz),
          (q.square * v.z + q.w * tz) + (q.x * ty - q.y * tx)};
}

/// Eight beams by their numbers.
struct EightBeams {  // NOLINT(cppcoreguidelines-pro-type-member-init): written before it is read
  alignas(32) float direction[3][8];
  alignas(32) float origin[3][8];
  alignas(32) float across[2][8];
  alignas(32) float fraction[8];
  alignas(32) float u[8];
  alignas(32) float v[8];
  std::uint32_t piece[8];
  bool is_one_piece;
};

/// `count` of them; lanes behind are as the last.
POINTFLIGHT_INLINE void take(const AimedBeams& aimed,
                             std::size_t begin,
                             std::size_t count,
                             EightBeams& eight) {
  eight.is_one_piece = true;
  for (std::size_t i = 0; i < 8; ++i) {
    const std::size_t number = begin + std::min(i, count - 1);
    const SensorBeam& beam = aimed.beams->beams[number];
    for (int k = 0; k < 3; ++k) eight.direction[k][i] = beam.direction[k];
    for (int k = 0; k < 3; ++k) eight.origin[k][i] = beam.origin[k];
    for (int k = 0; k < 2; ++k) eight.across[k][i] = beam.across[k];
    eight.fraction[i] = beam.fraction;
    eight.piece[i] = beam.piece;
    eight.is_one_piece = eight.is_one_piece && beam.piece == eight.piece[0];
    if (aimed.deviations.empty()) continue;
    eight.u[i] = aimed.deviations[number].u;
    eight.v[i] = aimed.deviations[number].v;
  }
}

/// A number of eight poses, between the ends of pieces.
template <class NumberOf>
POINTFLIGHT_INLINE F8 pose_number(const AimedBeams& aimed,
                                  const EightBeams& eight,
                                  const NumberOf& of) {
  if (aimed.poses.size() == 1) return splat(of(aimed.poses[0]));
  const F8 fraction = load(eight.fraction);
  if (eight.is_one_piece) {
    const float a = of(aimed.poses[eight.piece[0]]);
    const float b = of(aimed.poses[eight.piece[0] + 1]);
    return splat(a) + fraction * splat(b - a);
  }
  alignas(32) float from[8];
  alignas(32) float to[8];
  for (std::size_t i = 0; i < 8; ++i) {
    from[i] = of(aimed.poses[eight.piece[i]]);
    to[i] = of(aimed.poses[eight.piece[i] + 1]);
  }
  const F8 a = load(from);
  return a + fraction * (load(to) - a);
}

/// Directions turned away by their deviations.
POINTFLIGHT_INLINE AimVector deviated(const AimVector& d, const EightBeams& eight) {
  const F8 u = load(eight.u);
  const F8 v = load(eight.v);
  const F8 ax = load(eight.across[0]);
  const F8 ay = load(eight.across[1]);
  // a = (ax, ay, 0) and d x a
  return normalized({d.x + (u * ax - v * (d.z * ay)),
                     d.y + (u * ay + v * (d.z * ax)),
                     d.z + v * (d.x * ay - d.y * ax)});
}

POINTFLIGHT_INLINE void write(const AimVector& v,
                              std::size_t count,
                              float (AimedBeam::*member)[3],
                              AimedBeam* made) {
  alignas(32) float lanes[3][8];
  store(v.x, lanes[0]);
  store(v.y, lanes[1]);
  store(v.z, lanes[2]);
  for (std::size_t i = 0; i < count; ++i) {
    for (int k = 0; k < 3; ++k) (made[i].*member)[k] = lanes[k][i];
  }
}

static void aim(const AimedBeams& aimed,
                std::size_t begin,
                std::size_t count,
                bool wants_across,
                AimedBeam* made) {
  EightBeams eight;  // NOLINT(cppcoreguidelines-pro-type-member-init): written by `take`
  for (std::size_t at = 0; at < count; at += 8) {
    const std::size_t some = std::min<std::size_t>(8, count - at);
    take(aimed, begin + at, some, eight);
    const auto rotation = [&](int k) {
      return pose_number(aimed, eight, [&](const BeamPose& pose) { return pose.rotation[k]; });
    };
    const auto shift = [&](int k) {
      return pose_number(aimed, eight, [&](const BeamPose& pose) { return pose.shift[k]; });
    };
    AimTurn q{rotation(0), rotation(1), rotation(2), rotation(3), splat(0.0f)};
    q.square = ((q.x * q.x + q.y * q.y) + q.z * q.z) + q.w * q.w;
    AimVector d{load(eight.direction[0]), load(eight.direction[1]), load(eight.direction[2])};
    if (!aimed.deviations.empty()) d = deviated(d, eight);
    write(normalized(turned(q, d)), some, &AimedBeam::direction, made + at);
    AimVector from{shift(0), shift(1), shift(2)};
    if (aimed.beams->has_origins) {
      const AimVector o =
          turned(q, {load(eight.origin[0]), load(eight.origin[1]), load(eight.origin[2])});
      const F8 inverse = inverse_near_one(q.square);
      from = {from.x + o.x * inverse, from.y + o.y * inverse, from.z + o.z * inverse};
    }
    write(from, some, &AimedBeam::shift, made + at);
    if (!wants_across) continue;
    const AimVector across{load(eight.across[0]), load(eight.across[1]), splat(0.0f)};
    write(normalized(turned(q, across)), some, &AimedBeam::across, made + at);
  }
}

}  // namespace pointflight::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace pointflight {
namespace {

HWY_EXPORT(aim);

}  // namespace

void aim_some(const AimedBeams& aimed,
              std::size_t begin,
              std::span<AimedBeam> made,
              bool wants_across) {
  HWY_DYNAMIC_DISPATCH(aim)(aimed, begin, made.size(), wants_across, made.data());
}

}  // namespace pointflight
#endif  // HWY_ONCE
