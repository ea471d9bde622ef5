// Compiled once for each instruction set; one is picked at run time.
#include "pointflight/map/internal/nearest_kernel.hpp"

#include "pointflight/core/internal/simd_targets-inl.hpp"
// for foreach_target
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pointflight/map/internal/nearest_kernel.cpp"
#include <hwy/foreach_target.h>
// after foreach_target
#include "pointflight/map/internal/children-inl.hpp"
#include "pointflight/map/internal/surfel_lanes-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace pointflight::HWY_NAMESPACE {

/// Squared distances from a point to the boxes of eight children.
POINTFLIGHT_INLINE F8 child_bounds(const Bvh8Node& node, const float* p) {
  const F8 scale = splat(node.scale);
  F8 sum = splat(0.0f);
  for (int axis = 0; axis < 3; ++axis) {
    const F8 q = splat(p[axis] - node.origin[axis]);
    const F8 below = load_bytes(node.lo[axis]) * scale - q;
    const F8 above = q - load_bytes(node.hi[axis]) * scale;
    const F8 outside = max(splat(0.0f), max(below, above));
    sum = sum + outside * outside;
  }
  return sum;
}

/// Squared distances from a point to eight surfels' oriented boxes with half sides sqrt(3) s_k.
POINTFLIGHT_INLINE F8 surfel_distances(const SurfelScale& scale,
                                       const SurfelWord* words,
                                       const float* v) {
  const SurfelLanes s = load_surfels(scale, words);
  const Shapes e = decode_shapes(scale, s);
  const F8 x = s.x + splat(v[0]);
  const F8 y = s.y + splat(v[1]);
  const F8 z = s.z + splat(v[2]);
  const F8 half = splat(1.7320508f);  // a filled cell's deviation is r / sqrt(12)
  const F8 s2 = sqrt(s.variance2);
  const F8 s1 = s2 * look_up8(scale.ratio, right<24>(s.high) & splat_bits(7u));
  const auto outside = [&](const F8& u, const F8& deviation) {
    const F8 beyond = max(splat(0.0f), abs(u) - half) * deviation;
    return beyond * beyond;
  };
  return outside(e.m0x * x + e.m0y * y + e.m0z * z, e.s0) +
         outside(e.m1x * x + e.m1y * y + e.m1z * z, s1) +
         outside(e.m2x * x + e.m2y * y + e.m2z * z, s2);
}

static NearestWord nearest(const Bvh8Node* nodes,
                           std::size_t node_count,
                           const SurfelWord* words,
                           std::size_t word_count,
                           const SurfelScale& scale,
                           double resolution,
                           const double* point,
                           float limit) {
  Entry stack[kStack];  // t: a lower bound of the squared distance
  std::size_t depth = 0;
  NearestWord best;
  best.squared_distance = limit;
  if (node_count == 0) return best;
  const float p[3] = {
      static_cast<float>(point[0]), static_cast<float>(point[1]), static_cast<float>(point[2])};
  stack[depth++] = {0.0f, 0, Bvh8Node::kInner};
  std::size_t steps = node_count * 9 + 16;  // more visits than children: a cycle
  alignas(32) float bounds[8];
  while (depth > 0 && steps-- > 0) {
    const Entry entry = stack[--depth];
    if (entry.t > best.squared_distance) continue;
    if (entry.meta != Bvh8Node::kInner) {
      if (!is_readable_leaf(entry, word_count)) continue;
      const LeafHeader leaf = decode_leaf(words[entry.index]);
      const float v[3] = {static_cast<float>(leaf.x * resolution - point[0]),
                          static_cast<float>(leaf.y * resolution - point[1]),
                          static_cast<float>(leaf.z * resolution - point[2])};
      store(surfel_distances(scale, words + entry.index + 1, v), bounds);
      for (std::uint32_t i = 0; i < entry.meta; ++i) {
        if (bounds[i] < best.squared_distance || (bounds[i] == limit && best.word == 0)) {
          best = {bounds[i], entry.index, entry.index + 1 + i};
        }
      }
      continue;
    }
    if (entry.index >= node_count) continue;
    const Bvh8Node& node = nodes[entry.index];
    const F8 distances = child_bounds(node, p);
    store(distances, bounds);
    const std::uint32_t near_by = bits(distances <= splat(best.squared_distance));
    depth = push_children(nodes, words, node, near_by, bounds, stack, depth);
  }
  return best;
}

}  // namespace pointflight::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace pointflight {
namespace {

HWY_EXPORT(nearest);

}  // namespace

NearestWord find_nearest(std::span<const Bvh8Node> nodes,
                         std::span<const SurfelWord> words,
                         const SurfelScale& scale,
                         double resolution,
                         const Vector3d& point,
                         double max_distance) {
  return HWY_DYNAMIC_DISPATCH(nearest)(nodes.data(),
                                       nodes.size(),
                                       words.data(),
                                       words.size(),
                                       scale,
                                       resolution,
                                       point.data(),
                                       static_cast<float>(max_distance * max_distance));
}

}  // namespace pointflight
#endif  // HWY_ONCE
