#include <algorithm>
#include <array>
#include <cmath>

#include "pointflight/map/surfel_map.hpp"

namespace pointflight {
namespace {

/// A subtree or leaf that may hold something nearer.
struct Entry {
  float bound;  ///< Lower bound of the squared distance.
  std::uint32_t index;
  std::uint8_t meta;
};

/// Squared distance from a point to the surfel's oriented box. Metres from the leaf's origin.
float squared_distance(const Surfel& surfel, const Vector3f& point, float r) {
  constexpr float kHalfSide = 1.7320508f;  // a filled cell's deviation is r / sqrt(12)
  const Vector3f local = surfel.axes.transpose() * (point - r * surfel.center_voxels);
  float sum = 0.0f;
  for (int k = 0; k < 3; ++k) {
    const float outside = std::max(0.0f, std::abs(local[k]) - kHalfSide * r * surfel.s[k]);
    sum += outside * outside;
  }
  return sum;
}

/// Lower bounds for the eight children of a node.
std::array<float, 8> child_bounds(const Bvh8Node& node, const Vector3f& p) {
  std::array<float, 8> bounds{};
  for (int axis = 0; axis < 3; ++axis) {
    const float q = p[axis] - node.origin[axis];
    for (std::size_t i = 0; i < 8; ++i) {
      const float low = static_cast<float>(node.lo[axis][i]) * node.scale - q;
      const float high = q - static_cast<float>(node.hi[axis][i]) * node.scale;
      const float outside = std::max(0.0f, std::max(low, high));
      bounds[i] += outside * outside;
    }
  }
  return bounds;
}

}  // namespace

std::optional<Nearest> SurfelMap::nearest(const Vector3d& point_world, double max_distance) const {
  // inner children of a path are at most 7 a level and 60 levels deep; a corrupt map stops here
  constexpr std::size_t kStack = 512;
  std::array<Entry, kStack> stack;  // NOLINT(cppcoreguidelines-pro-type-member-init): written first
  std::size_t depth = 0;
  if (nodes_.empty()) return std::nullopt;
  const Vector3d p = point_world - origin_;
  const Vector3f pf = p.cast<float>();
  const auto r = static_cast<float>(resolution_);
  float best = static_cast<float>(max_distance * max_distance);
  struct Found {
    std::uint32_t leaf;
    std::uint32_t word;
  };
  std::optional<Found> found;
  stack[depth++] = {0.0f, 0, Bvh8Node::kInner};
  std::size_t steps = nodes_.size() * 9 + 16;  // more visits than children: a cycle
  while (depth > 0 && steps-- > 0) {
    const Entry entry = stack[--depth];
    if (entry.bound > best) continue;
    if (entry.meta != Bvh8Node::kInner) {
      if (entry.index + entry.meta + kLeafPadding >= words_.size()) continue;
      const LeafHeader leaf = decode_leaf(words_[entry.index]);
      const Vector3f local = (p - resolution_ * Vector3d(leaf.x, leaf.y, leaf.z)).cast<float>();
      for (std::uint32_t i = 1; i <= entry.meta; ++i) {
        const float d2 = squared_distance(decode(words_[entry.index + i]), local, r);
        if (d2 < best || (d2 == best && !found)) {
          best = d2;
          found = {entry.index, entry.index + i};
        }
      }
      continue;
    }
    if (entry.index >= nodes_.size()) continue;
    const Bvh8Node& node = nodes_[entry.index];
    const auto bounds = child_bounds(node, pf);
    std::uint32_t inner = node.first_inner;
    std::uint32_t word = node.first_leaf_word;
    const std::size_t first = depth;
    for (std::size_t i = 0; i < 8; ++i) {
      const std::uint8_t meta = node.meta[i];
      if (meta == 0) continue;
      const bool is_inner = meta == Bvh8Node::kInner;
      const std::uint32_t index = is_inner ? inner : word;
      if (is_inner) {
        ++inner;
      } else {
        word += meta + 1u;
      }
      if (bounds[i] <= best && depth < kStack && (is_inner || meta <= 8)) {
        stack[depth++] = {bounds[i], index, meta};
      }
    }
    // nearest on top
    std::sort(stack.begin() + static_cast<std::ptrdiff_t>(first),
              stack.begin() + static_cast<std::ptrdiff_t>(depth),
              [](const Entry& a, const Entry& b) { return a.bound > b.bound; });
  }
  if (!found) return std::nullopt;
  const LeafHeader leaf = decode_leaf(words_[found->leaf]);
  const Vector3d center =
      origin_ + resolution_ * (Vector3d(leaf.x, leaf.y, leaf.z) +
                               decode(words_[found->word]).center_voxels.cast<double>());
  return Nearest{std::sqrt(static_cast<double>(best)), center, found->word};
}

}  // namespace pointflight
