#include "pointflight/map/bvh8.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cassert>
#include <cmath>

#include "pointflight/geometry/morton.hpp"

namespace pointflight {
namespace {

constexpr std::size_t kMaxLeafSurfels = 8;
constexpr std::uint32_t kMaxLeafVoxels = 13;  // 10 bits at r / 64 reach 16

struct Range {
  std::size_t begin;
  std::size_t end;
  [[nodiscard]] std::size_t count() const { return end - begin; }
};

struct Box {
  Vector3f min = Vector3f::Constant(std::numeric_limits<float>::infinity());
  Vector3f max = Vector3f::Constant(-std::numeric_limits<float>::infinity());
  void add(const Box& other) {
    min = min.cwiseMin(other.min);
    max = max.cwiseMax(other.max);
  }
};

class Builder {
 public:
  Builder(const std::vector<BuildSurfel>& surfels, double resolution)
      : surfels_(surfels), r_(resolution) {}

  Bvh8 build() {
    if (!surfels_.empty()) {
      tree_.nodes.emplace_back();
      const Box box = build_node(0, {0, surfels_.size()});
      tree_.bounds.min = box.min.cast<double>();
      tree_.bounds.max = box.max.cast<double>();
    }
    tree_.words.resize(tree_.words.size() + kLeafPadding, 0);
    tree_.intensity.resize(tree_.words.size(), 0);
    return std::move(tree_);
  }

 private:
  /// Fills node `index` with the surfels of `range` and returns their box.
  Box build_node(std::size_t index, Range range) {
    std::array<Range, 8> children{};
    std::size_t count = 0;
    children[count++] = range;
    // open the largest child that is no leaf yet, until there are eight
    while (count < 8) {
      std::size_t largest = count;
      for (std::size_t i = 0; i < count; ++i) {
        const bool larger = largest == count || children[i].count() > children[largest].count();
        if (larger && !is_leaf(children[i])) largest = i;
      }
      if (largest == count) break;
      const Range whole = children[largest];
      const std::size_t middle = split(whole);
      // keep Morton order
      std::copy_backward(children.begin() + static_cast<std::ptrdiff_t>(largest) + 1,
                         children.begin() + static_cast<std::ptrdiff_t>(count),
                         children.begin() + static_cast<std::ptrdiff_t>(count) + 1);
      children[largest] = {whole.begin, middle};
      children[largest + 1] = {middle, whole.end};
      ++count;
    }

    std::array<std::uint8_t, 8> meta{};
    std::array<Box, 8> boxes;
    const std::size_t first_leaf_word = tree_.words.size();
    const std::size_t first_inner = tree_.nodes.size();
    std::size_t inner_count = 0;
    for (std::size_t i = 0; i < count; ++i) {
      if (is_leaf(children[i])) {
        meta[i] = static_cast<std::uint8_t>(children[i].count());
        boxes[i] = append_leaf(children[i]);
      } else {
        meta[i] = Bvh8Node::kInner;
        ++inner_count;
      }
    }
    tree_.nodes.resize(first_inner + inner_count);
    std::size_t next_inner = first_inner;
    for (std::size_t i = 0; i < count; ++i) {
      if (meta[i] == Bvh8Node::kInner) boxes[i] = build_node(next_inner++, children[i]);
    }

    Box whole;
    for (std::size_t i = 0; i < count; ++i) whole.add(boxes[i]);
    Bvh8Node& node = tree_.nodes[index];
    node = {};
    node.first_inner = static_cast<std::uint32_t>(first_inner);
    node.first_leaf_word = static_cast<std::uint32_t>(first_leaf_word);
    quantise(whole, boxes, count, node);
    std::copy(meta.begin(), meta.end(), node.meta);
    return whole;
  }

  [[nodiscard]] bool is_leaf(const Range& range) const {
    if (range.count() > kMaxLeafSurfels) return false;
    const auto [min, max] = voxel_bounds(range);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (max[axis] - min[axis] >= kMaxLeafVoxels) return false;
    }
    return true;
  }

  using Voxel = std::array<std::uint32_t, 3>;
  [[nodiscard]] std::pair<Voxel, Voxel> voxel_bounds(const Range& range) const {
    Voxel min = morton_decode(surfels_[range.begin].morton);
    Voxel max = min;
    for (std::size_t i = range.begin + 1; i < range.end; ++i) {
      const Voxel voxel = morton_decode(surfels_[i].morton);
      for (std::size_t axis = 0; axis < 3; ++axis) {
        min[axis] = std::min(min[axis], voxel[axis]);
        max[axis] = std::max(max[axis], voxel[axis]);
      }
    }
    return {min, max};
  }

  /// First surfel whose key has the range's highest differing bit set.
  [[nodiscard]] std::size_t split(const Range& range) const {
    const std::uint64_t first = surfels_[range.begin].morton;
    const std::uint64_t last = surfels_[range.end - 1].morton;
    assert(first < last);
    const std::uint64_t bit = std::bit_floor(first ^ last);
    const std::uint64_t border = last & ~(bit - 1);
    const auto at =
        std::lower_bound(surfels_.begin() + static_cast<std::ptrdiff_t>(range.begin),
                         surfels_.begin() + static_cast<std::ptrdiff_t>(range.end),
                         border,
                         [](const BuildSurfel& s, std::uint64_t key) { return s.morton < key; });
    return static_cast<std::size_t>(at - surfels_.begin());
  }

  Box append_leaf(const Range& range) {
    const Voxel origin = voxel_bounds(range).first;
    tree_.words.push_back(encode(
        LeafHeader{origin[0], origin[1], origin[2], static_cast<std::uint32_t>(range.count())}));
    tree_.intensity.push_back(0);
    Box box;
    for (std::size_t i = range.begin; i < range.end; ++i) {
      const BuildSurfel& surfel = surfels_[i];
      const Voxel voxel = morton_decode(surfel.morton);
      Surfel packed;
      for (std::size_t a = 0; a < 3; ++a) {
        const int axis = static_cast<int>(a);
        packed.center_voxels[axis] =
            static_cast<float>(voxel[a] - origin[a]) + surfel.center_in_voxel[axis];
      }
      packed.axes = surfel.axes;
      packed.s = surfel.s;
      const SurfelWord word = encode(packed);
      tree_.words.push_back(word);
      tree_.intensity.push_back(surfel.intensity);
      box.add(support_box(decode(word), origin));
    }
    return box;
  }

  /// Box of the ellipsoid of kSupport standard deviations as the reader decodes it, grown so that
  /// rounding, the reader's included, can never lose a hit.
  [[nodiscard]] Box support_box(const Surfel& surfel, const Voxel& origin) const {
    Box box;
    for (int axis = 0; axis < 3; ++axis) {
      double variance = 0.0;
      for (int k = 0; k < 3; ++k) {
        const double part = static_cast<double>(surfel.s[k] * surfel.axes(axis, k)) * r_;
        variance += part * part;
      }
      const double center = (origin[static_cast<std::size_t>(axis)] +
                             static_cast<double>(surfel.center_voxels[axis])) *
                            r_;
      const double half =
          static_cast<double>(kSupport) * std::sqrt(variance) * 1.04 + 0.02 * r_ + center * 0x1p-21;
      box.min[axis] = static_cast<float>(center - half);
      box.max[axis] = static_cast<float>(center + half);
    }
    return box;
  }

  static void quantise(const Box& whole,
                       const std::array<Box, 8>& boxes,
                       std::size_t count,
                       Bvh8Node& node) {
    const float extent = (whole.max - whole.min).maxCoeff();
    node.scale = std::nextafter(extent / 254.0f, std::numeric_limits<float>::infinity());
    for (int axis = 0; axis < 3; ++axis) node.origin[axis] = whole.min[axis];
    for (std::size_t i = 0; i < count; ++i) {
      for (int axis = 0; axis < 3; ++axis) {
        const float low = (boxes[i].min[axis] - node.origin[axis]) / node.scale;
        const float high = (boxes[i].max[axis] - node.origin[axis]) / node.scale;
        node.lo[axis][i] =
            static_cast<std::uint8_t>(std::clamp(std::floor(low - 1e-3f), 0.0f, 255.0f));
        node.hi[axis][i] =
            static_cast<std::uint8_t>(std::clamp(std::ceil(high + 1e-3f), 0.0f, 255.0f));
      }
    }
  }

  const std::vector<BuildSurfel>& surfels_;
  double r_;
  Bvh8 tree_;
};

}  // namespace

Bvh8 build_bvh8(const std::vector<BuildSurfel>& surfels, double resolution) {
  return Builder(surfels, resolution).build();
}

}  // namespace pointflight
