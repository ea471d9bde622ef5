#include "pointflight/map/bvh8.hpp"

#include <algorithm>
#include <span>
#include <vector>

#include "pointflight/map/internal/bvh8_part.hpp"
#include "pointflight/map/internal/voxel_moments.hpp"

namespace pointflight {
namespace {

constexpr std::size_t kPartSurfels = 1 << 15;
constexpr std::size_t kHighPartSurfels = 1 << 20;  // few nodes are left to the simpler rule

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
          parts_.size(), 1, [&](std::size_t i, std::size_t) { parts_[i].part.build(scratch); });
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
    NodeBox box;
  };
  struct PartInTree {
    TreePart part;
    std::size_t slot = 0;  ///< Of its root in the tree; the other nodes and words lie together.
  };

  void plan(std::size_t index, const Range& range) {
    if (range.count() <= part_surfels_) {  // the whole map
      parts_.push_back({TreePart(surfels_, range, quality_)});
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
        parts_.push_back({TreePart(surfels_, part, quality_)});
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
    const TreePart& part = p.part;
    for (std::size_t i = 0; i < part.nodes.size(); ++i) {
      Bvh8Node node = part.nodes[i];
      node.first_inner += static_cast<std::uint32_t>(node_at - 1);
      node.first_leaf_word += static_cast<std::uint32_t>(word_at);
      tree.nodes[i == 0 ? p.slot : node_at + i - 1] = node;
    }
    std::copy(part.words.begin(), part.words.end(), tree.words.begin() + word_at);
    if (part.intensity.size() > 0) {
      std::copy(part.intensity.begin(), part.intensity.end(), tree.intensity.begin() + word_at);
    }
    tree.nodes.release(node_at, node_at + part.nodes.size() - 1);
    tree.words.release(word_at, word_at + part.words.size());
  }

  void finish(TopNode& top, Bvh8& tree) {
    std::array<NodeBox, 8> boxes;
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

Aabb bounds_of(std::span<const BuildSurfel> surfels,
               const Vector3d& base_world,
               double resolution) {
  Aabb bounds;
  for (const BuildSurfel& surfel : surfels) {
    const auto voxel = morton_decode(surfel.morton);
    const Vector3d corner = Vector3d(voxel[0], voxel[1], voxel[2]).array() - kMaxVoxel;
    bounds.add(base_world + resolution * (corner + center_voxels(surfel.word).cast<double>()));
  }
  return bounds;
}

Bvh8 build_bvh8(const TreeInput& input,
                TreeQuality quality,
                const Executor& executor,
                Scratch& scratch) {
  return TreeBuilder(input, quality).build(executor, scratch);
}

}  // namespace pointflight
