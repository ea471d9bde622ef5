#pragma once

#include <algorithm>
#include <array>
#include <cassert>
#include <cstdint>
#include <cstring>

#include "pointflight/map/surfel_map.hpp"

namespace pointflight {

/// What a surfel is in distances: its oriented box with half sides sqrt(3) s_k.
struct SurfelBox {
  Pose T_world_box;
  Vector3d half;           ///< m
  std::uint32_t word = 0;  ///< Index of the surfel in `SurfelMap::words()`.
};

/// The box of the surfel at a word index below `map.words().size()`, which debug builds assert, in
/// a leaf whose header is `leaf`.
inline SurfelBox surfel_box(const SurfelMap& map, const LeafHeader& leaf, std::uint32_t word) {
  assert(word < map.words().size());
  const Surfel surfel = decode(map.words()[word]);
  const double r = map.resolution();
  const Vector3d corner = r * Vector3d(leaf.x, leaf.y, leaf.z);
  constexpr double kHalf = 1.7320508075688772;  // a filled cell's deviation is r / sqrt(12)
  SurfelBox box;
  box.T_world_box.translation =
      map.origin_world() + (corner + r * surfel.center_voxels.cast<double>());
  box.T_world_box.rotation = Quaterniond(surfel.axes.cast<double>()).normalized();
  box.half = kHalf * r * surfel.s.cast<double>();
  box.word = word;
  return box;
}

/// Calls `visit(box)` for each surfel whose leaf comes within `reach` of a box in the world, near
/// leaves first. `visit` returns the reach from then on (never a larger one). For hulls that are
/// not balls; the nearest surfel to a point is `SurfelMap::nearest`, which is faster.
template <class Visit>
void visit_near(const SurfelMap& map, const Aabb& box_world, double reach, const Visit& visit) {
  struct Entry {
    double distance;
    std::uint32_t index;
    std::uint8_t meta;
  };
  // 7 siblings a level; a corrupt map stops being followed here, or at the limit of steps
  std::array<Entry, 512> stack;  // NOLINT(cppcoreguidelines-pro-type-member-init): written first
  std::size_t depth = 0;
  std::size_t steps = map.nodes().size() * 9 + 16;
  if (!map.nodes().empty()) stack[depth++] = {0.0, 0, Bvh8Node::kInner};
  const Vector3d low = box_world.min - map.origin_world();
  const Vector3d high = box_world.max - map.origin_world();
  while (depth > 0 && steps-- > 0) {
    const Entry entry = stack[--depth];
    if (entry.distance > reach) continue;
    if (entry.meta != Bvh8Node::kInner) {
      const std::size_t last = static_cast<std::size_t>(entry.index) + entry.meta;
      if (last + kLeafPadding >= map.words().size()) continue;
      const LeafHeader leaf = decode_leaf(map.words()[entry.index]);
      for (std::uint32_t i = 1; i <= entry.meta; ++i) {
        reach = visit(surfel_box(map, leaf, entry.index + i));
      }
      continue;
    }
    if (entry.index >= map.nodes().size()) continue;
    const Bvh8Node& node = map.nodes()[entry.index];
    const std::size_t bottom = depth;
    std::uint32_t inner = node.first_inner;
    std::uint32_t word = node.first_leaf_word;
    for (std::size_t lane = 0; lane < 8; ++lane) {
      const std::uint8_t meta = node.meta[lane];
      if (meta == 0) continue;
      const std::uint32_t index = meta == Bvh8Node::kInner ? inner : word;
      (meta == Bvh8Node::kInner ? inner : word) += meta == Bvh8Node::kInner ? 1u : meta + 1u;
      double squared = 0.0;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const auto origin = static_cast<double>(node.origin[axis]);
        const auto scale = static_cast<double>(node.scale);
        const int i = static_cast<int>(axis);
        const double outside = std::max({0.0,
                                         origin + node.lo[axis][lane] * scale - high[i],
                                         low[i] - origin - node.hi[axis][lane] * scale});
        squared += outside * outside;
      }
      const double distance = std::sqrt(squared);
      if (distance > reach || depth >= stack.size()) continue;
      std::size_t at = depth++;
      for (; at > bottom && stack[at - 1].distance < distance; --at) stack[at] = stack[at - 1];
      stack[at] = {distance, index, meta};
    }
  }
}

}  // namespace pointflight
