#include "pointflight/map/bvh8.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cassert>
#include <cmath>
#include <numeric>

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
  Builder(const std::vector<BuildSurfel>& surfels, double resolution, TreeQuality quality)
      : surfels_(surfels), r_(resolution), quality_(quality), order_(surfels.size()) {
    std::iota(order_.begin(), order_.end(), 0u);
  }

  Bvh8 build() {
    if (quality_ == TreeQuality::kHigh) {
      boxes_.reserve(surfels_.size());
      for (const BuildSurfel& surfel : surfels_) boxes_.push_back(loose_box(surfel));
    }
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
        const bool larger = largest == count || size_of(children[i]) > size_of(children[largest]);
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
    Voxel min = morton_decode(at(range.begin).morton);
    Voxel max = min;
    for (std::size_t i = range.begin + 1; i < range.end; ++i) {
      const Voxel voxel = morton_decode(at(i).morton);
      for (std::size_t axis = 0; axis < 3; ++axis) {
        min[axis] = std::min(min[axis], voxel[axis]);
        max[axis] = std::max(max[axis], voxel[axis]);
      }
    }
    return {min, max};
  }

  [[nodiscard]] const BuildSurfel& at(std::size_t i) const { return surfels_[order_[i]]; }

  /// What makes a child worth opening: its surfels, or the chance that a ray comes by.
  [[nodiscard]] double size_of(const Range& range) const {
    if (quality_ == TreeQuality::kNormal) return static_cast<double>(range.count());
    Box box;
    for (std::size_t i = range.begin; i < range.end; ++i) box.add(boxes_[order_[i]]);
    return area_of(box);
  }

  static double area_of(const Box& box) {
    const Vector3f d = box.max - box.min;
    return static_cast<double>(d.x() * d.y() + d.y() * d.z() + d.z() * d.x());
  }

  [[nodiscard]] std::size_t split(const Range& range) {
    return quality_ == TreeQuality::kHigh ? split_by_area(range) : split_by_key(range);
  }

  /// Surface area heuristic in 16 bins an axis; a part of n surfels costs its area times the leaves
  /// that it will have.
  [[nodiscard]] std::size_t split_by_area(const Range& range) {
    constexpr std::size_t kBins = 16;
    Vector3f low = Vector3f::Constant(std::numeric_limits<float>::infinity());
    Vector3f high = -low;
    for (std::size_t i = range.begin; i < range.end; ++i) {
      const Vector3f c = center_of(boxes_[order_[i]]);
      low = low.cwiseMin(c);
      high = high.cwiseMax(c);
    }
    double best_cost = std::numeric_limits<double>::infinity();
    int best_axis = -1;
    std::size_t best_bin = 0;
    for (int axis = 0; axis < 3; ++axis) {
      if (!(high[axis] > low[axis])) continue;
      std::array<Box, kBins> bins;
      std::array<std::size_t, kBins> counts{};
      const float scale = bins_per_metre(low[axis], high[axis], kBins);
      for (std::size_t i = range.begin; i < range.end; ++i) {
        const Box& box = boxes_[order_[i]];
        const std::size_t bin = bin_of(center_of(box)[axis], low[axis], scale, kBins);
        bins[bin].add(box);
        ++counts[bin];
      }
      // costs of the upper parts, then of the lower ones
      std::array<double, kBins> above{};
      Box box;
      std::size_t count = 0;
      for (std::size_t bin = kBins - 1; bin > 0; --bin) {
        box.add(bins[bin]);
        count += counts[bin];
        above[bin] = count == 0 ? 0.0 : area_of(box) * leaves_of(count);
      }
      box = {};
      count = 0;
      for (std::size_t bin = 0; bin + 1 < kBins; ++bin) {
        box.add(bins[bin]);
        count += counts[bin];
        if (count == 0 || count == range.count()) continue;
        const double cost = area_of(box) * leaves_of(count) + above[bin + 1];
        if (cost < best_cost) {
          best_cost = cost;
          best_axis = axis;
          best_bin = bin;
        }
      }
    }
    if (best_axis < 0) return split_in_halves(range);
    const float scale = bins_per_metre(low[best_axis], high[best_axis], kBins);
    const auto middle = std::stable_partition(
        order_.begin() + static_cast<std::ptrdiff_t>(range.begin),
        order_.begin() + static_cast<std::ptrdiff_t>(range.end),
        [&](std::uint32_t i) {
          return bin_of(center_of(boxes_[i])[best_axis], low[best_axis], scale, kBins) <= best_bin;
        });
    return static_cast<std::size_t>(middle - order_.begin());
  }

  /// All centres at one place.
  static std::size_t split_in_halves(const Range& range) { return range.begin + range.count() / 2; }

  static Vector3f center_of(const Box& box) { return 0.5f * (box.min + box.max); }
  static float bins_per_metre(float low, float high, std::size_t bins) {
    return static_cast<float>(bins) / (high - low);
  }
  static std::size_t bin_of(float x, float low, float scale, std::size_t bins) {
    return std::min(bins - 1, static_cast<std::size_t>((x - low) * scale));
  }
  static double leaves_of(std::size_t count) {
    return std::ceil(static_cast<double>(count) / static_cast<double>(kMaxLeafSurfels));
  }

  /// Box of the support before packing, metres from the map's origin.
  [[nodiscard]] Box loose_box(const BuildSurfel& surfel) const {
    Surfel whole;
    whole.center_voxels = surfel.center_in_voxel;
    whole.axes = surfel.axes;
    whole.s = surfel.s;
    return support_box(whole, morton_decode(surfel.morton));
  }

  /// First surfel whose key has the range's highest differing bit set.
  [[nodiscard]] std::size_t split_by_key(const Range& range) const {
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
      const BuildSurfel& surfel = at(i);
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
  TreeQuality quality_;
  std::vector<std::uint32_t> order_;  ///< Of the surfels in the leaves; by Morton code at first.
  std::vector<Box> boxes_;            ///< For kHigh.
  Bvh8 tree_;
};

}  // namespace

Bvh8 build_bvh8(const std::vector<BuildSurfel>& surfels, double resolution, TreeQuality quality) {
  return Builder(surfels, resolution, quality).build();
}

}  // namespace pointflight
