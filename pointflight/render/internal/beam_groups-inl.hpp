// Groups of beams that go down the tree together: who they are, and the frustum around them.
//
// Neighbouring beams hit much the same nodes of the hierarchy. Eight beams make a group, whose
// lanes the arithmetic works on; up to eight groups go together, as a packet if they lie close
// (packet-inl.hpp), as a bundle if they do not (bundle-inl.hpp). Around them lies a frustum:
// four planes through an apex (the first beam's origin, moved outwards by as far as other origins
// lie from it), with the mean direction w as its axis and u, v across it.
//
// Included once a target by Highway's foreach_target; see beam_kernel.cpp.
#if defined(POINTFLIGHT_RENDER_BEAM_GROUPS_INL_HPP) == defined(HWY_TARGET_TOGGLE)
#ifdef POINTFLIGHT_RENDER_BEAM_GROUPS_INL_HPP
#undef POINTFLIGHT_RENDER_BEAM_GROUPS_INL_HPP
#else
#define POINTFLIGHT_RENDER_BEAM_GROUPS_INL_HPP
#endif

#include "pointflight/render/internal/beam_kernel-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace pointflight::HWY_NAMESPACE {

inline constexpr std::size_t kGroups = 8;
inline constexpr std::size_t kTogether = 8 * kGroups;  ///< Beams.

/// Eight beams.
struct Group {
  alignas(32) float dx[8], dy[8], dz[8];
  alignas(32) float end[8];
  alignas(32) float first[8];
  alignas(32) std::int32_t total[8];
  alignas(32) float nearest[8];  ///< The least t of all hits.
  float mean[3];                 ///< Of the directions.
  /// `GridOrigin`s, by axis.
  ///@{
  alignas(32) std::int32_t voxel[3][8];
  alignas(32) float rest[3][8];
  ///@}
  GridOrigin origin(int axis, std::size_t beam) const {
    return {voxel[axis][beam], rest[axis][beam]};
  }
};

/// Up to 64 beams.
struct BeamGroups {
  // The beams' directions d as positions (d.u / d.w, d.v / d.w) in a plane across the mean
  // direction w: a rectangle around each group; lanes are groups.
  alignas(32) float middle_u[8], middle_v[8], half_u[8], half_v[8], group_end[8];
  float u[3], v[3], w[3];
  float low_u, high_u, low_v, high_v;  ///< Around all groups.
  float norm;                          ///< Of the frustum's normals below, the greatest.
  GridOrigin apex[3];
  float apex_box[3];  ///< The same from the map's origin, m, for boxes.
  float spread;       ///< Origins lie so far from the apex at most.
  bool one_origin;
  float plane[4][3];               ///< Inward normals of the frustum's sides.
  float offset[4];                 ///< n . (p - apex) >= offset inside.
  std::uint32_t plane_side[4][3];  ///< Of the box: where its corner farthest inside is.
  int main_axis;
  std::uint32_t main_side;
  float main_step;    ///< 1 / (greatest component along the main axis), signed.
  float main_offset;  ///< Of the origins along the main axis, the one that shortens most.
  float end;          ///< Farthest end of all beams.
  std::size_t count;  ///< Of the groups that are there.
  Group groups[kGroups];
};

/// Copies eight beams to a group. False if they are too far apart to go together: more than
/// `widest` from their mean direction, rad.
POINTFLIGHT_INLINE bool take_beams(const MapRay* rays,
                                   const std::uint32_t* beams,
                                   float widest,
                                   Group& group) {
  for (std::size_t i = 0; i < 8; ++i) {
    const MapRay& ray = rays[beams[i]];
    group.dx[i] = ray.direction[0];
    group.dy[i] = ray.direction[1];
    group.dz[i] = ray.direction[2];
    group.end[i] = ray.range_max;
    for (int k = 0; k < 3; ++k) {
      group.voxel[k][i] = ray.voxel[k];
      group.rest[k][i] = ray.rest[k];
    }
  }
  const F8 dx = load(group.dx);
  const F8 dy = load(group.dy);
  const F8 dz = load(group.dz);
  group.mean[0] = 0.125f * sum(dx);
  group.mean[1] = 0.125f * sum(dy);
  group.mean[2] = 0.125f * sum(dz);
  const F8 x = dx - splat(group.mean[0]);
  const F8 y = dy - splat(group.mean[1]);
  const F8 z = dz - splat(group.mean[2]);
  if (!(greatest(x * x + y * y + z * z) <= widest * widest)) return false;
  store(splat(kNever), group.first);
  store(splat(kNever), group.nearest);
  store(splat_int(0), group.total);
  return true;
}

/// True if a group may join another, up to `farthest` away, rad: neighbours along the curve through
/// the beams lie together, but for the curve's leaps.
POINTFLIGHT_INLINE bool lies_near(const Group& group, const Group& other, float farthest) {
  float squared = 0.0f;
  for (int k = 0; k < 3; ++k) {
    squared += (group.mean[k] - other.mean[k]) * (group.mean[k] - other.mean[k]);
  }
  return squared <= farthest * farthest;
}

/// From eight beams' origins to a voxel along an axis, m: `to_corner`.
POINTFLIGHT_INLINE F8 to_voxel(const KernelMap& map,
                               const Group& group,
                               int axis,
                               std::int32_t voxel) {
  const F8 voxels = to_float(splat_int(voxel) - load(group.voxel[axis]));
  return voxels * splat(map.r) - load(group.rest[axis]);
}

/// How far the origins of the beams lie from the apex, which is the first one.
POINTFLIGHT_INLINE float spread_of(const KernelMap& map, const BeamGroups& p) {
  F8 squared = splat(0.0f);
  bool moves = false;
  for (std::size_t g = 0; g < p.count; ++g) {
    for (int k = 0; k < 3; ++k) {
      const Group& group = p.groups[g];
      for (std::size_t i = 0; i < 8; ++i) {
        moves = moves || group.voxel[k][i] != p.apex[k].voxel || group.rest[k][i] != p.apex[k].rest;
      }
    }
  }
  if (!moves) return 0.0f;
  for (std::size_t g = 0; g < p.count; ++g) {
    F8 distance = splat(0.0f);
    for (int k = 0; k < 3; ++k) {
      const F8 away = to_voxel(map, p.groups[g], k, p.apex[k].voxel) + splat(p.apex[k].rest);
      distance = distance + away * away;
    }
    squared = max(squared, distance);
  }
  return std::sqrt(greatest(squared)) * 1.001f;
}

/// The four planes around all groups, which lie within [low_u, high_u] x [low_v, high_v].
POINTFLIGHT_INLINE void set_up_planes(BeamGroups& p,
                                      const Vector3f& u,
                                      const Vector3f& v,
                                      const Vector3f& w) {
  const Vector3f normals[4] = {
      u - p.low_u * w, p.high_u * w - u, v - p.low_v * w, p.high_v * w - v};
  p.norm = 0.0f;
  for (int k = 0; k < 4; ++k) {
    p.norm = std::max(p.norm, normals[k].norm() * 1.001f);
    p.offset[k] = -p.spread * normals[k].norm() * 1.001f;  // origins lie up to the spread outside
    for (int axis = 0; axis < 3; ++axis) {
      p.plane[k][axis] = normals[k][axis];
      p.plane_side[k][axis] =
          static_cast<std::uint32_t>(axis) + (normals[k][axis] > 0.0f ? 3u : 0u);
    }
  }
}

/// The apex is the first beam's origin; the others lie up to the spread away.
POINTFLIGHT_INLINE void set_up_apex(const KernelMap& map, BeamGroups& p) {
  for (int k = 0; k < 3; ++k) {
    p.apex[k] = p.groups[0].origin(k, 0);
    p.apex_box[k] = -to_corner(0, p.apex[k], map.r);
  }
  p.spread = spread_of(map, p);
  p.one_origin = p.spread == 0.0f;
}

/// Origins and ends of the first `count` groups. Returns the sum of their mean directions.
POINTFLIGHT_INLINE Vector3f set_up_groups(const KernelMap& map, BeamGroups& p, std::size_t count) {
  p.count = count;
  set_up_apex(map, p);
  Vector3f mean = Vector3f::Zero();
  for (std::size_t g = 0; g < kGroups; ++g) {
    // what is not there hits nothing
    p.group_end[g] = g < count ? greatest(load(p.groups[g].end)) : -kNever;
    for (int k = 0; k < 3 && g < count; ++k) mean[k] += p.groups[g].mean[k];
  }
  p.end = greatest(load(p.group_end));
  return mean;
}

/// Sets up the frustum around the groups in a frame along whose w all beams go forwards.
POINTFLIGHT_INLINE void set_up_frustum(BeamGroups& p,
                                       const Vector3f& u,
                                       const Vector3f& v,
                                       const Vector3f& w) {
  for (int k = 0; k < 3; ++k) {
    p.u[k] = u[k];
    p.v[k] = v[k];
    p.w[k] = w[k];
  }
  int main_axis = 0;
  w.cwiseAbs().maxCoeff(&main_axis);

  // where each group's beams cross the plane at distance 1 along w, and how fast they go along the
  // main axis
  F8 steepest = splat(0.0f);
  alignas(32) float low[2][8];  // by group
  alignas(32) float high[2][8];
  for (std::size_t g = 0; g < kGroups; ++g) {
    const Group& group = p.groups[g < p.count ? g : 0];
    const F8 dx = load(group.dx);
    const F8 dy = load(group.dy);
    const F8 dz = load(group.dz);
    const F8 ahead = dx * splat(w.x()) + dy * splat(w.y()) + dz * splat(w.z());
    const F8 per_ahead = splat(1.0f) / ahead;
    const F8 at_u = (dx * splat(u.x()) + dy * splat(u.y()) + dz * splat(u.z())) * per_ahead;
    const F8 at_v = (dx * splat(v.x()) + dy * splat(v.y()) + dz * splat(v.z())) * per_ahead;
    low[0][g] = least(at_u);
    high[0][g] = greatest(at_u);
    low[1][g] = least(at_v);
    high[1][g] = greatest(at_v);
    steepest = max(steepest, abs(main_axis == 0 ? dx : main_axis == 1 ? dy : dz));
  }

  // a rectangle around each group, and one around all
  const float room = 1e-5f;  // for rounding
  const F8 half = splat(0.5f);
  const F8 half_u = (load(high[0]) - load(low[0])) * half;
  const F8 half_v = (load(high[1]) - load(low[1])) * half;
  store((load(low[0]) + load(high[0])) * half, p.middle_u);
  store((load(low[1]) + load(high[1])) * half, p.middle_v);
  store(half_u + splat(room), p.half_u);
  store(half_v + splat(room), p.half_v);

  p.low_u = least(load(low[0])) - room;
  p.high_u = greatest(load(high[0])) + room;
  p.low_v = least(load(low[1])) - room;
  p.high_v = greatest(load(high[1])) + room;
  set_up_planes(p, u, v, w);

  // along the axis that w is closest to, all beams go forward: a bound of t
  p.main_axis = main_axis;
  const bool forward = w[main_axis] > 0.0f;
  p.main_side = static_cast<std::uint32_t>(main_axis) + (forward ? 0u : 3u);
  p.main_step = (forward ? 1.0f : -1.0f) / (greatest(steepest) * 1.0001f);
  p.main_offset = (forward ? p.spread : -p.spread) * 1.001f;
}

/// Sets up the frustum around the first `count` groups: w along the mean direction.
POINTFLIGHT_INLINE void set_up(const KernelMap& map, BeamGroups& p, std::size_t count) {
  const Vector3f w = set_up_groups(map, p, count).normalized();
  const Vector3f helper = std::abs(w.z()) < 0.9f ? Vector3f::UnitZ() : Vector3f::UnitX();
  const Vector3f u = w.cross(helper).normalized();
  set_up_frustum(p, u, w.cross(u), w);
}

}  // namespace pointflight::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
