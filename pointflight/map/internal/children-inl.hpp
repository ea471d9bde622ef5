// The way down the tree that beams, packets and distances share: where the children of a node lie,
// and a stack with the nearest on top.
//
// Included once a target by Highway's foreach_target; see nearest_kernel.cpp and
// render/internal/beam_kernel.cpp.
#if defined(POINTFLIGHT_MAP_CHILDREN_INL_HPP) == defined(HWY_TARGET_TOGGLE)
#ifdef POINTFLIGHT_MAP_CHILDREN_INL_HPP
#undef POINTFLIGHT_MAP_CHILDREN_INL_HPP
#else
#define POINTFLIGHT_MAP_CHILDREN_INL_HPP
#endif

#include <hwy/cache_control.h>

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>

#include "pointflight/core/internal/simd8-inl.hpp"
#include "pointflight/map/bvh8.hpp"

HWY_BEFORE_NAMESPACE();
namespace pointflight::HWY_NAMESPACE {

/// 7 siblings a level and 60 levels of Morton bits; a corrupt map stops being followed here.
inline constexpr std::size_t kStack = 512;

/// A node or leaf that waits to be visited.
struct Entry {
  float t;              ///< How far it is: what its visitor orders by, the least first.
  std::uint32_t index;  ///< Node, or word of a leaf's header.
  std::uint32_t meta;   ///< Bvh8Node::meta
};

/// True for a leaf whose words all exist, with the padding that a reader may touch. Offsets of a
/// corrupt map can be anything, so no sum of 32 bits.
POINTFLIGHT_INLINE bool is_readable_leaf(const Entry& entry, std::size_t word_count) {
  const std::size_t first = entry.index;
  return entry.meta - 1u <= 7u && first + entry.meta + kLeafPadding < word_count;
}

POINTFLIGHT_INLINE std::uint64_t meta_of(const Bvh8Node& node) {
  std::uint64_t meta = 0;
  std::memcpy(&meta, node.meta, 8);
  return meta;
}

/// The child in a lane of a node: inner ones are consecutive, and so are the words of leaves.
POINTFLIGHT_INLINE Entry child_of(const Bvh8Node& node,
                                  std::uint64_t meta,
                                  const float* distances,
                                  int lane) {
  constexpr std::uint64_t kOnes = 0x0101010101010101ull;
  const int shift = 8 * lane;
  const std::uint64_t before = meta & ((1ull << shift) - 1ull);
  const auto own = static_cast<std::uint32_t>(meta >> shift) & 0xffu;
  if (own == Bvh8Node::kInner) {
    const auto nodes_before = static_cast<std::uint32_t>(std::popcount(before & (0x80ull * kOnes)));
    return {distances[lane], node.first_inner + nodes_before, own};
  }
  // a leaf of n surfels has n + 1 words
  const std::uint64_t counts = before & (0x7full * kOnes);
  const std::uint64_t words = counts + (((counts + 0x7full * kOnes) >> 7) & kOnes);
  return {distances[lane],
          node.first_leaf_word + static_cast<std::uint32_t>((words * kOnes) >> 56),
          own};
}

POINTFLIGHT_INLINE void prefetch(const Bvh8Node* nodes,
                                 const SurfelWord* words,
                                 const Entry& entry) {
  const char* place = entry.meta == Bvh8Node::kInner
                          ? reinterpret_cast<const char*>(nodes + entry.index)
                          : reinterpret_cast<const char*>(words + entry.index);
  hwy::Prefetch(place);
  hwy::Prefetch(place + 64);
}

/// Pushes the children of a node that have their bit in `which`, the nearest on top. Returns the
/// new depth of the stack.
POINTFLIGHT_INLINE std::size_t push_children(const Bvh8Node* nodes,
                                             const SurfelWord* words,
                                             const Bvh8Node& node,
                                             std::uint32_t which,
                                             const float* distances,
                                             Entry* stack,
                                             std::size_t depth) {
  const std::uint64_t meta = meta_of(node);
  const std::size_t bottom = depth;
  for (; which != 0 && depth < kStack; which &= which - 1) {
    const Entry child = child_of(node, meta, distances, std::countr_zero(which));
    if (child.meta == 0) continue;
    prefetch(nodes, words, child);
    std::size_t at = depth++;
    for (; at > bottom && stack[at - 1].t < child.t; --at) stack[at] = stack[at - 1];
    stack[at] = child;
  }
  return depth;
}

}  // namespace pointflight::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
