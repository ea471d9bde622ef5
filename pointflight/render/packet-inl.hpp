// Packets of beams: what they are, and which boxes they may touch.
//
// Included once a target by Highway's foreach_target; see beam_kernel.cpp.
#if defined(POINTFLIGHT_RENDER_PACKET_INL_HPP) == defined(HWY_TARGET_TOGGLE)
#ifdef POINTFLIGHT_RENDER_PACKET_INL_HPP
#undef POINTFLIGHT_RENDER_PACKET_INL_HPP
#else
#define POINTFLIGHT_RENDER_PACKET_INL_HPP
#endif

#include "pointflight/render/beam_kernel-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace pointflight::HWY_NAMESPACE {

inline constexpr std::size_t kGroups = 8;
inline constexpr std::size_t kPacket = 8 * kGroups;
/// Rows of hits of one group: beyond, its beams are traced singly.
inline constexpr std::size_t kRows = 96;
/// Wider groups (tangent of half the angle) meet so many surfels apart that single rays are faster.
inline constexpr float kWidestGroup = 0.012f;

/// Hits of eight beams: a row is one surfel, lanes that it does not meet hold kNever and weight 0.
struct HitRows {
  std::size_t count;
  alignas(32) float t[kRows][8];
  alignas(32) std::int32_t weight[kRows][8];
  alignas(32) float cosine[kRows][8];
  std::uint32_t word[kRows];
};

/// Eight beams.
struct Group {
  alignas(32) float dx[8], dy[8], dz[8];
  alignas(32) float end[8];
  alignas(32) float first[8];
  alignas(32) std::int32_t total[8];
  alignas(32) float nearest[8];  ///< The least t of all hits.
  double origin[3][8];
  HitRows rows;
};

struct Packet {
  // cones around the groups, seen from the apex: lanes are groups
  alignas(32) float axis_x[8], axis_y[8], axis_z[8], tangent[8], group_end[8];
  double apex[3];     ///< From the map's origin.
  float apex_box[3];  ///< The same in float, for boxes.
  float spread;       ///< Origins lie so far from the apex at most.
  bool one_origin;
  float plane[4][3];               ///< Inward normals of the frustum's sides.
  float offset[4];                 ///< n . (p - apex) >= offset inside.
  std::uint32_t plane_side[4][3];  ///< Of the box: where its corner farthest inside is.
  int main_axis;
  std::uint32_t main_side;
  float main_step;       ///< 1 / (greatest component along the main axis), signed.
  float main_offset;     ///< Of the origins along the main axis, the one that shortens most.
  float end;             ///< Farthest end of all beams.
  std::uint32_t failed;  ///< Groups to be traced singly.
  Group groups[kGroups];
};

/// Sets up a packet. False where its beams are better traced singly.
POINTFLIGHT_INLINE bool gather(const KernelMap& map,
                               const Ray* rays,
                               const std::uint32_t* order,
                               Packet& p) {
  Vector3f mean = Vector3f::Zero();
  for (std::size_t i = 0; i < kPacket; ++i) mean += rays[order[i]].direction_world;
  const float length = mean.norm();
  if (!(length > 0.9f * kPacket)) return false;
  mean /= length;
  const Vector3d& apex = rays[order[0]].origin_world;
  const Vector3f helper = std::abs(mean.z()) < 0.9f ? Vector3f::UnitZ() : Vector3f::UnitX();
  const Vector3f u = mean.cross(helper).normalized();
  const Vector3f v = mean.cross(u);
  int main_axis = 0;
  mean.cwiseAbs().maxCoeff(&main_axis);

  float low[2] = {kNever, kNever};
  float high[2] = {-kNever, -kNever};
  float spread = 0.0f;
  float greatest_component = 0.0f;
  for (std::size_t g = 0; g < kGroups; ++g) {
    Group& group = p.groups[g];
    Vector3f axis = Vector3f::Zero();
    for (std::size_t i = 0; i < 8; ++i) axis += rays[order[8 * g + i]].direction_world;
    axis.normalize();
    float tangent = 0.0f;
    float farthest = 0.0f;
    for (std::size_t i = 0; i < 8; ++i) {
      const Ray& ray = rays[order[8 * g + i]];
      const Vector3f& d = ray.direction_world;
      const float cosine = d.dot(axis);
      if (!(cosine > 0.9f)) return false;
      tangent = std::max(tangent, (d / cosine - axis).norm());
      const float ahead = d.dot(mean);
      if (!(ahead > 0.5f)) return false;
      const float across[2] = {d.dot(u) / ahead, d.dot(v) / ahead};
      for (int k = 0; k < 2; ++k) {
        low[k] = std::min(low[k], across[k]);
        high[k] = std::max(high[k], across[k]);
      }
      const Vector3f away = (ray.origin_world - apex).cast<float>();
      spread = std::max(spread, away.norm());
      greatest_component = std::max(greatest_component, std::abs(d[main_axis]));
      group.dx[i] = d.x();
      group.dy[i] = d.y();
      group.dz[i] = d.z();
      group.end[i] = ray.range_max;
      group.first[i] = kNever;
      group.total[i] = 0;
      group.nearest[i] = kNever;
      for (int k = 0; k < 3; ++k) group.origin[k][i] = ray.origin_world[k] - map.origin[k];
      farthest = std::max(farthest, ray.range_max);
    }
    if (tangent > kWidestGroup) return false;
    p.axis_x[g] = axis.x();
    p.axis_y[g] = axis.y();
    p.axis_z[g] = axis.z();
    p.tangent[g] = tangent * 1.001f + 1e-6f;
    p.group_end[g] = farthest;
    group.rows.count = 0;
  }

  for (int k = 0; k < 3; ++k) {
    p.apex[k] = apex[k] - map.origin[k];
    p.apex_box[k] = static_cast<float>(p.apex[k]);
  }
  p.spread = spread;
  p.one_origin = spread == 0.0f;
  p.end = *std::max_element(p.group_end, p.group_end + kGroups);
  p.failed = 0;
  // a little room for rounding, and for origins beside the apex
  const float room = 1e-5f;
  const Vector3f normals[4] = {u - (low[0] - room) * mean,
                               (high[0] + room) * mean - u,
                               v - (low[1] - room) * mean,
                               (high[1] + room) * mean - v};
  for (int k = 0; k < 4; ++k) {
    p.offset[k] = -spread * normals[k].norm() * 1.001f;
    for (int axis = 0; axis < 3; ++axis) {
      p.plane[k][axis] = normals[k][axis];
      p.plane_side[k][axis] =
          static_cast<std::uint32_t>(axis) + (normals[k][axis] > 0.0f ? 3u : 0u);
    }
  }
  p.main_axis = main_axis;
  const bool forward = mean[main_axis] > 0.0f;
  p.main_side = static_cast<std::uint32_t>(main_axis) + (forward ? 0u : 3u);
  p.main_step = (forward ? 1.0f : -1.0f) / (greatest_component * 1.0001f);
  p.main_offset = (forward ? spread : -spread) * 1.001f;
  return true;
}

/// Which children the frustum may touch, and a lower bound of the distance to each.
POINTFLIGHT_INLINE std::uint32_t test_node(const Packet& p,
                                           const Bvh8Node& node,
                                           float* distances) {
  // lo x, y, z, hi x, y, z of the children, metres from the node's corner
  alignas(32) float sides[6][8];
  const F8 scale = splat(node.scale);
  for (int k = 0; k < 3; ++k) {
    store(load_bytes(node.lo[k]) * scale, sides[k]);
    store(load_bytes(node.hi[k]) * scale, sides[k + 3]);
  }
  float corner[3];
  for (int axis = 0; axis < 3; ++axis) corner[axis] = node.origin[axis] - p.apex_box[axis];
  const F8 distance = max(
      splat(0.0f),
      (splat(corner[p.main_axis] - p.main_offset) + load(sides[p.main_side])) * splat(p.main_step));
  store(distance, distances);
  F8 inside = splat(p.end) - distance;
  for (int k = 0; k < 4; ++k) {
    const float* n = p.plane[k];
    const std::uint32_t* side = p.plane_side[k];
    const F8 depth = splat(n[0]) * (splat(corner[0]) + load(sides[side[0]])) +
                     splat(n[1]) * (splat(corner[1]) + load(sides[side[1]])) +
                     splat(n[2]) * (splat(corner[2]) + load(sides[side[2]]));
    inside = min(inside, depth - splat(p.offset[k]));
  }
  return bits(splat(-1e-4f * node.scale) <= inside);
}

}  // namespace pointflight::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
