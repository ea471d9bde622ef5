#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include "pointflight/core/scratch.hpp"
#include "pointflight/geometry/internal/morton.hpp"
#include "pointflight/map/bvh8.hpp"

namespace pointflight {

/// Surfels or parts that follow each other.
struct Range {
  std::size_t begin;
  std::size_t end;
  [[nodiscard]] std::size_t count() const { return end - begin; }
};

/// Lanes 0 to 2; four are as fast as one.
struct NodeBox {
  Eigen::Array4f min = Eigen::Array4f::Constant(std::numeric_limits<float>::infinity());
  Eigen::Array4f max = Eigen::Array4f::Constant(-std::numeric_limits<float>::infinity());
  void add(const NodeBox& other) {
    min = min.min(other.min);
    max = max.max(other.max);
  }
  [[nodiscard]] Eigen::Array4f center() const { return 0.5f * (min + max); }
  [[nodiscard]] double half_area() const {
    const Eigen::Array4f d = max - min;
    return static_cast<double>(d[0] * d[1] + d[1] * d[2] + d[2] * d[0]);
  }
};

using Voxel = std::array<std::uint32_t, 3>;

/// Up to eight parts of a node's range, in the order of their surfels.
struct Children {
  std::array<Range, 8> ranges{};
  std::size_t count = 0;
};

/// Two parts of a range and how much each is worth being opened.
struct Split {
  std::size_t middle;
  double first_worth;
  double second_worth;
};

/// Opens the child that is worth most and no leaf, until there are eight.
template <class IsLeaf, class SplitRange>
Children open_children(const Range& range, const IsLeaf& is_leaf, const SplitRange& split) {
  Children children;
  auto& ranges = children.ranges;
  std::array<double, 8> worth{};  // negative: a leaf
  const auto set = [&](std::size_t i, const Range& part, double value) {
    ranges[i] = part;
    worth[i] = is_leaf(part) ? -1.0 : value;
  };
  set(0, range, 0.0);
  children.count = 1;
  while (children.count < ranges.size()) {
    std::size_t best = 0;
    for (std::size_t i = 1; i < children.count; ++i) {
      if (worth[i] > worth[best]) best = i;
    }
    if (worth[best] < 0.0) break;
    const Range whole = ranges[best];
    const Split parts = split(whole);
    for (std::size_t i = children.count; i > best + 1; --i) {
      ranges[i] = ranges[i - 1];
      worth[i] = worth[i - 1];
    }
    set(best, {whole.begin, parts.middle}, parts.first_worth);
    set(best + 1, {parts.middle, whole.end}, parts.second_worth);
    ++children.count;
  }
  return children;
}

/// What the nodes of a tree are made of, whoever makes them.
class Surfels {
 public:
  explicit Surfels(const TreeInput& input) : input_(input) {}

  [[nodiscard]] std::size_t count() const { return input_.surfels.size(); }
  [[nodiscard]] bool has_intensity() const { return input_.intensity.size() > 0; }
  [[nodiscard]] SurfelWord word(std::size_t i) const { return input_.surfels[i].word; }
  [[nodiscard]] std::uint8_t intensity(std::size_t i) const { return input_.intensity[i]; }
  [[nodiscard]] Voxel voxel(std::size_t i) const {
    Voxel voxel = morton_decode(input_.surfels[i].morton);
    for (std::size_t axis = 0; axis < 3; ++axis) voxel[axis] -= input_.low[axis];
    return voxel;
  }

  /// Releases a range that will not be read again.
  void release(const Range& range) const { input_.surfels.release(range.begin, range.end); }

  /// The second part begins with the first surfel whose key has the range's highest differing bit
  /// set; parts are worth what they hold.
  [[nodiscard]] Split split_by_key(const Range& range) const;

  /// NodeBox of the ellipsoid of kSupport standard deviations as the reader decodes it, grown so
  /// that rounding, the reader's included, can never lose a hit. Metres from the map's origin.
  [[nodiscard]] NodeBox support_box(SurfelWord word, const Voxel& origin) const;

 private:
  TreeInput input_;
};

/// Fills in a node's frame and the boxes of its children, lanes in their order.
void quantise(const NodeBox& whole, std::span<const NodeBox> boxes, Bvh8Node& node);

/// The tree over a range of surfels, built by one thread; node 0 is its root. Indices count from
/// the part's own beginnings.
class TreePart {
 public:
  TreePart(const Surfels& surfels, const Range& range, TreeQuality quality)
      : surfels_(surfels), range_(range), quality_(quality) {}

  ScratchArray<Bvh8Node> nodes;
  ScratchArray<SurfelWord> words;
  ScratchArray<std::uint8_t> intensity;
  NodeBox box;

  void build(Scratch& scratch);

  /// Forgets all but the box.
  void clear();

 private:
  NodeBox build_node(std::size_t index, const Range& range);
  NodeBox append_leaf(const Range& range);
  [[nodiscard]] bool is_leaf(const Range& range) const;
  [[nodiscard]] std::pair<Voxel, Voxel> voxel_bounds(const Range& range) const;
  [[nodiscard]] Split split(const Range& range);
  [[nodiscard]] Split split_by_area(const Range& range);

  /// Number in the whole map of the i-th surfel of the part.
  [[nodiscard]] std::size_t surfel(std::size_t i) const { return range_.begin + order_[i]; }
  [[nodiscard]] std::span<std::uint32_t> order(const Range& range) {
    return std::span(order_).subspan(range.begin, range.count());
  }

  const Surfels& surfels_;
  Range range_;
  TreeQuality quality_;
  // while it grows; the scratch arrays above have their exact sizes
  std::vector<Bvh8Node> new_nodes_;
  std::vector<SurfelWord> new_words_;
  std::vector<std::uint8_t> new_intensity_;
  std::vector<std::uint32_t> order_;  ///< Of the surfels in the leaves; by Morton code at first.
  std::vector<NodeBox> boxes_;        ///< For kHigh, in the order of the input.
};

}  // namespace pointflight
