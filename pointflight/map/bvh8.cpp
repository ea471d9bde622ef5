#include "pointflight/map/bvh8.hpp"

#include <algorithm>
#include <bit>
#include <cassert>
#include <cmath>
#include <numeric>
#include <span>
#include <vector>

#include "pointflight/geometry/morton.hpp"

namespace pointflight {
namespace {

constexpr std::size_t kMaxLeafSurfels = 8;
constexpr std::uint32_t kMaxLeafVoxels = 13;  // 10 bits at r / 64 reach 16
constexpr std::size_t kPartSurfels = 1 << 15;
constexpr std::size_t kHighPartSurfels = 1 << 17;  // few nodes are left to the simpler rule

struct Range {
  std::size_t begin;
  std::size_t end;
  [[nodiscard]] std::size_t count() const { return end - begin; }
};

/// Lanes 0 to 2; four are as fast as one.
struct Box {
  Eigen::Array4f min = Eigen::Array4f::Constant(std::numeric_limits<float>::infinity());
  Eigen::Array4f max = Eigen::Array4f::Constant(-std::numeric_limits<float>::infinity());
  void add(const Box& other) {
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

  /// These have been used for the last time.
  void release(const Range& range) const { input_.surfels.release(range.begin, range.end); }

  /// The second part begins with the first surfel whose key has the range's highest differing bit
  /// set; parts are worth what they hold.
  [[nodiscard]] Split split_by_key(const Range& range) const {
    const auto surfels = input_.surfels.span();
    const std::uint64_t first = surfels[range.begin].morton;
    const std::uint64_t last = surfels[range.end - 1].morton;
    assert(first < last);
    const std::uint64_t bit = std::bit_floor(first ^ last);
    const std::uint64_t border = last & ~(bit - 1);
    const auto at =
        std::lower_bound(surfels.begin() + static_cast<std::ptrdiff_t>(range.begin),
                         surfels.begin() + static_cast<std::ptrdiff_t>(range.end),
                         border,
                         [](const BuildSurfel& s, std::uint64_t key) { return s.morton < key; });
    const auto middle = static_cast<std::size_t>(at - surfels.begin());
    return {
        middle, static_cast<double>(middle - range.begin), static_cast<double>(range.end - middle)};
  }

  /// Box of the ellipsoid of kSupport standard deviations as the reader decodes it, grown so that
  /// rounding, the reader's included, can never lose a hit. Metres from the map's origin.
  [[nodiscard]] Box support_box(SurfelWord word, const Voxel& origin) const {
    const Surfel surfel = decode(word);
    const double r = input_.resolution;
    Box box{Eigen::Array4f::Zero(), Eigen::Array4f::Zero()};
    for (int axis = 0; axis < 3; ++axis) {
      double variance = 0.0;
      for (int k = 0; k < 3; ++k) {
        const double part = static_cast<double>(surfel.s[k] * surfel.axes(axis, k)) * r;
        variance += part * part;
      }
      const double center = (origin[static_cast<std::size_t>(axis)] +
                             static_cast<double>(surfel.center_voxels[axis])) *
                            r;
      const double half =
          static_cast<double>(kSupport) * std::sqrt(variance) * 1.04 + 0.02 * r + center * 0x1p-21;
      box.min[axis] = static_cast<float>(center - half);
      box.max[axis] = static_cast<float>(center + half);
    }
    return box;
  }

 private:
  TreeInput input_;
};

void quantise(const Box& whole, std::span<const Box> boxes, Bvh8Node& node) {
  const float extent = (whole.max - whole.min).head<3>().maxCoeff();
  node.scale = std::nextafter(extent / 254.0f, std::numeric_limits<float>::infinity());
  for (int axis = 0; axis < 3; ++axis) node.origin[axis] = whole.min[axis];
  for (std::size_t i = 0; i < boxes.size(); ++i) {
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

/// The tree over a range of surfels, built by one thread; node 0 is its root. Indices count from
/// the part's own beginnings.
class Part {
 public:
  Part(const Surfels& surfels, const Range& range, TreeQuality quality)
      : surfels_(surfels), range_(range), quality_(quality) {}

  std::vector<Bvh8Node> nodes;
  std::vector<SurfelWord> words;
  std::vector<std::uint8_t> intensity;
  Box box;

  void build() {
    order_.resize(range_.count());
    std::iota(order_.begin(), order_.end(), 0u);
    if (quality_ == TreeQuality::kHigh) {
      boxes_.reserve(order_.size());
      for (std::size_t i = range_.begin; i < range_.end; ++i) {
        boxes_.push_back(surfels_.support_box(surfels_.word(i), surfels_.voxel(i)));
      }
    }
    nodes.emplace_back();
    box = build_node(0, {0, order_.size()});
    order_ = {};
    boxes_ = {};
    surfels_.release(range_);
    nodes.shrink_to_fit();
    words.shrink_to_fit();
    intensity.shrink_to_fit();
  }

  /// Forgets all but the box.
  void clear() {
    nodes = {};
    words = {};
    intensity = {};
  }

 private:
  /// Fills node `index` with the surfels of `range` and returns their box.
  Box build_node(std::size_t index, const Range& range) {
    const Children children = open_children(
        range,
        [this](const Range& part) { return is_leaf(part); },
        [this](const Range& part) { return split(part); });
    std::array<std::uint8_t, 8> meta{};
    std::array<Box, 8> boxes;
    const std::size_t first_leaf_word = words.size();
    const std::size_t first_inner = nodes.size();
    std::size_t inner_count = 0;
    for (std::size_t i = 0; i < children.count; ++i) {
      if (is_leaf(children.ranges[i])) {
        meta[i] = static_cast<std::uint8_t>(children.ranges[i].count());
        boxes[i] = append_leaf(children.ranges[i]);
      } else {
        meta[i] = Bvh8Node::kInner;
        ++inner_count;
      }
    }
    nodes.resize(first_inner + inner_count);
    std::size_t next_inner = first_inner;
    for (std::size_t i = 0; i < children.count; ++i) {
      if (meta[i] == Bvh8Node::kInner) boxes[i] = build_node(next_inner++, children.ranges[i]);
    }
    Box whole;
    for (std::size_t i = 0; i < children.count; ++i) whole.add(boxes[i]);
    Bvh8Node& node = nodes[index];
    node = {};
    node.first_inner = static_cast<std::uint32_t>(first_inner);
    node.first_leaf_word = static_cast<std::uint32_t>(first_leaf_word);
    quantise(whole, std::span(boxes).first(children.count), node);
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

  [[nodiscard]] std::pair<Voxel, Voxel> voxel_bounds(const Range& range) const {
    Voxel min = surfels_.voxel(surfel(range.begin));
    Voxel max = min;
    for (std::size_t i = range.begin + 1; i < range.end; ++i) {
      const Voxel voxel = surfels_.voxel(surfel(i));
      for (std::size_t axis = 0; axis < 3; ++axis) {
        min[axis] = std::min(min[axis], voxel[axis]);
        max[axis] = std::max(max[axis], voxel[axis]);
      }
    }
    return {min, max};
  }

  /// Number in the whole map of the i-th surfel of the part.
  [[nodiscard]] std::size_t surfel(std::size_t i) const { return range_.begin + order_[i]; }

  [[nodiscard]] Split split(const Range& range) {
    if (quality_ == TreeQuality::kHigh) return split_by_area(range);
    // in this quality the order is still that of the keys
    const std::size_t first = range_.begin;
    Split parts = surfels_.split_by_key({first + range.begin, first + range.end});
    parts.middle -= first;
    return parts;
  }

  static constexpr std::size_t kMostBins = 16;
  struct Bins {
    std::array<Box, kMostBins> boxes;
    std::array<std::uint32_t, kMostBins> counts{};
  };

  /// Surface area heuristic over bins along each axis (Wald 2007): a part of n surfels costs its
  /// area times the leaves that it will have; its area is also what it is worth.
  [[nodiscard]] Split split_by_area(const Range& range) {
    const std::size_t bins = range.count() < 64 ? 8 : kMostBins;
    Eigen::Array4f low = Eigen::Array4f::Constant(std::numeric_limits<float>::infinity());
    Eigen::Array4f high = -low;
    for (std::size_t i = range.begin; i < range.end; ++i) {
      const Eigen::Array4f center = boxes_[order_[i]].center();
      low = low.min(center);
      high = high.max(center);
    }
    // an axis without extent has but one bin
    const Eigen::Array4f extent = high - low;
    const Eigen::Array4f scale =
        (extent > 0.0f).select(static_cast<float>(bins) / extent, Eigen::Array4f::Zero());
    const auto bins_of = [&](const Box& box) -> Eigen::Array4i {
      return ((box.center() - low) * scale).cast<int>().min(static_cast<int>(bins) - 1);
    };
    std::array<Bins, 3> along;
    for (std::size_t i = range.begin; i < range.end; ++i) {
      const Box& box = boxes_[order_[i]];
      const Eigen::Array4i bin = bins_of(box);
      for (int axis = 0; axis < 3; ++axis) {
        Bins& of_axis = along[static_cast<std::size_t>(axis)];
        const auto k = static_cast<std::size_t>(bin[axis]);
        of_axis.boxes[k].add(box);
        ++of_axis.counts[k];
      }
    }
    double best_cost = std::numeric_limits<double>::infinity();
    int best_axis = -1;
    std::size_t best_bin = 0;
    Split parts{};
    for (int axis = 0; axis < 3; ++axis) {
      if (scale[axis] == 0.0f) continue;
      const Bins& of_axis = along[static_cast<std::size_t>(axis)];
      std::array<double, kMostBins> above{};  // areas of the parts from a bin on
      Box box;
      for (std::size_t bin = bins - 1; bin > 0; --bin) {
        box.add(of_axis.boxes[bin]);
        above[bin] = box.half_area();
      }
      box = {};
      std::size_t count = 0;
      for (std::size_t bin = 0; bin + 1 < bins; ++bin) {
        box.add(of_axis.boxes[bin]);
        count += of_axis.counts[bin];
        if (count == 0 || count == range.count()) continue;
        const double area = box.half_area();
        const double cost =
            area * leaves_of(count) + above[bin + 1] * leaves_of(range.count() - count);
        if (cost < best_cost) {
          best_cost = cost;
          best_axis = axis;
          best_bin = bin;
          parts = {range.begin + count, area, above[bin + 1]};
        }
      }
    }
    if (best_axis < 0) {  // all centres at one place
      const double area = range.count() > 0 ? boxes_[order_[range.begin]].half_area() : 0.0;
      return {range.begin + range.count() / 2, area, area};
    }
    std::stable_partition(order_.begin() + static_cast<std::ptrdiff_t>(range.begin),
                          order_.begin() + static_cast<std::ptrdiff_t>(range.end),
                          [&](std::uint32_t i) {
                            return static_cast<std::size_t>(bins_of(boxes_[i])[best_axis]) <=
                                   best_bin;
                          });
    return parts;
  }

  static double leaves_of(std::size_t count) {
    const std::size_t leaves = (count + kMaxLeafSurfels - 1) / kMaxLeafSurfels;
    return static_cast<double>(leaves);
  }

  Box append_leaf(const Range& range) {
    const Voxel origin = voxel_bounds(range).first;
    words.push_back(encode(
        LeafHeader{origin[0], origin[1], origin[2], static_cast<std::uint32_t>(range.count())}));
    if (surfels_.has_intensity()) intensity.push_back(0);
    Box whole;
    for (std::size_t i = range.begin; i < range.end; ++i) {
      const Voxel voxel = surfels_.voxel(surfel(i));
      SurfelWord word = surfels_.word(surfel(i));
      for (std::size_t axis = 0; axis < 3; ++axis) {
        // 64 steps a voxel
        word += static_cast<SurfelWord>(voxel[axis] - origin[axis]) << (6 + 10 * axis);
      }
      words.push_back(word);
      if (surfels_.has_intensity()) intensity.push_back(surfels_.intensity(surfel(i)));
      whole.add(surfels_.support_box(word, origin));
    }
    return whole;
  }

  const Surfels& surfels_;
  Range range_;
  TreeQuality quality_;
  std::vector<std::uint32_t> order_;  ///< Of the surfels in the leaves; by Morton code at first.
  std::vector<Box> boxes_;            ///< For kHigh, in the order of the input.
};

/// The upper nodes, down to ranges that one thread builds at a stroke.
class TreeBuilder {
 public:
  TreeBuilder(const TreeInput& input, TreeQuality quality)
      : surfels_(input),
        quality_(quality),
        part_surfels_(quality == TreeQuality::kHigh ? kHighPartSurfels : kPartSurfels) {}

  Bvh8 build(const Executor& executor, Scratch& scratch) {
    if (surfels_.count() > 0) {
      top_.emplace_back();
      plan(0, {0, surfels_.count()});
      executor.parallel_for(
          parts_.size(), 1, [&](std::size_t i, std::size_t) { parts_[i].part.build(); });
    }
    return assemble(scratch);
  }

 private:
  /// A child of an upper node: another one, or the root of a part.
  struct TopChild {
    bool is_part;
    std::size_t index;
  };
  struct TopNode {
    std::vector<TopChild> children;
    std::size_t slot = 0;  ///< Of the node in the tree.
    Box box;
  };
  struct PartInTree {
    Part part;
    std::size_t slot = 0;  ///< Of its root in the tree; the other nodes and words lie together.
  };

  void plan(std::size_t index, const Range& range) {
    if (range.count() <= part_surfels_) {  // the whole map
      parts_.push_back({Part(surfels_, range, quality_)});
      top_.clear();
      return;
    }
    const Children children = open_children(
        range,
        [this](const Range& part) { return part.count() <= part_surfels_; },
        [this](const Range& part) { return surfels_.split_by_key(part); });
    for (std::size_t i = 0; i < children.count; ++i) {
      const Range& part = children.ranges[i];
      if (part.count() <= part_surfels_) {
        top_[index].children.push_back({true, parts_.size()});
        parts_.push_back({Part(surfels_, part, quality_)});
      } else {
        top_[index].children.push_back({false, top_.size()});
        const std::size_t child = top_.size();
        top_.emplace_back();
        plan(child, part);
      }
    }
  }

  Bvh8 assemble(Scratch& scratch) {
    // upper nodes and the roots of parts come first: children of a node lie together
    std::size_t next = 1;
    for (TopNode& node : top_) {
      for (const TopChild& child : node.children) {
        (child.is_part ? parts_[child.index].slot : top_[child.index].slot) = next++;
      }
    }
    std::size_t nodes = parts_.empty() ? 0 : next;
    std::size_t words = 0;
    for (const PartInTree& p : parts_) {
      nodes += p.part.nodes.size() - 1;
      words += p.part.words.size();
    }
    Bvh8 tree{
        ScratchArray<Bvh8Node>(scratch, nodes),
        ScratchArray<SurfelWord>(scratch, words + kLeafPadding),
        ScratchArray<std::uint8_t>(scratch, surfels_.has_intensity() ? words + kLeafPadding : 0)};
    std::size_t next_node = next;
    std::size_t next_word = 0;
    for (PartInTree& p : parts_) {
      append(p, tree, next_node, next_word);
      next_node += p.part.nodes.size() - 1;
      next_word += p.part.words.size();
      p.part.clear();
    }
    // children lie behind their parents
    for (std::size_t i = top_.size(); i-- > 0;) finish(top_[i], tree);
    return tree;
  }

  static void append(const PartInTree& p, Bvh8& tree, std::size_t node_at, std::size_t word_at) {
    const Part& part = p.part;
    for (std::size_t i = 0; i < part.nodes.size(); ++i) {
      Bvh8Node node = part.nodes[i];
      node.first_inner += static_cast<std::uint32_t>(node_at - 1);
      node.first_leaf_word += static_cast<std::uint32_t>(word_at);
      tree.nodes[i == 0 ? p.slot : node_at + i - 1] = node;
    }
    std::copy(part.words.begin(), part.words.end(), tree.words.begin() + word_at);
    if (!part.intensity.empty()) {
      std::copy(part.intensity.begin(), part.intensity.end(), tree.intensity.begin() + word_at);
    }
    tree.words.release(word_at, word_at + part.words.size());
  }

  void finish(TopNode& top, Bvh8& tree) {
    std::array<Box, 8> boxes;
    Bvh8Node node{};
    for (std::size_t i = 0; i < top.children.size(); ++i) {
      const TopChild& child = top.children[i];
      boxes[i] = child.is_part ? parts_[child.index].part.box : top_[child.index].box;
      const std::size_t slot = child.is_part ? parts_[child.index].slot : top_[child.index].slot;
      if (i == 0) node.first_inner = static_cast<std::uint32_t>(slot);
      node.meta[i] = Bvh8Node::kInner;
      top.box.add(boxes[i]);
    }
    quantise(top.box, std::span(boxes).first(top.children.size()), node);
    tree.nodes[top.slot] = node;
  }

  Surfels surfels_;
  TreeQuality quality_;
  std::size_t part_surfels_;
  std::vector<TopNode> top_;
  std::vector<PartInTree> parts_;
};

}  // namespace

Bvh8 build_bvh8(const TreeInput& input,
                TreeQuality quality,
                const Executor& executor,
                Scratch& scratch) {
  return TreeBuilder(input, quality).build(executor, scratch);
}

}  // namespace pointflight
