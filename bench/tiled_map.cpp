#include "bench/tiled_map.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "pointflight/core/scratch.hpp"
#include "pointflight/map/map_file.hpp"

namespace pointflight {
namespace {

constexpr double kRoom = 0.01;  // m around boxes: floats round

/// Around a node's children, m from the map's origin.
Aabb box_of(const Bvh8Node& node) {
  Aabb box;
  for (int lane = 0; lane < 8; ++lane) {
    if (node.meta[lane] == 0) continue;
    Vector3d low;
    Vector3d high;
    for (int k = 0; k < 3; ++k) {
      low[k] =
          static_cast<double>(node.origin[k]) + static_cast<double>(node.scale) * node.lo[k][lane];
      high[k] =
          static_cast<double>(node.origin[k]) + static_cast<double>(node.scale) * node.hi[k][lane];
    }
    box.add(low);
    box.add(high);
  }
  return box;
}

/// A parent of up to eight nodes that lie one after the other.
Bvh8Node parent_of(const Bvh8Node* children, std::size_t count, std::size_t first) {
  Aabb all;
  std::vector<Aabb> boxes;
  for (std::size_t i = 0; i < count; ++i) {
    boxes.push_back(box_of(children[i]));
    all.add(boxes.back().min);
    all.add(boxes.back().max);
  }
  Bvh8Node node{};
  for (int k = 0; k < 3; ++k) node.origin[k] = static_cast<float>(all.min[k] - kRoom);
  node.scale = static_cast<float>((all.size().maxCoeff() + 3.0 * kRoom) / 254.0);
  node.first_inner = static_cast<std::uint32_t>(first);
  const auto scale = static_cast<double>(node.scale);
  for (std::size_t i = 0; i < count; ++i) {
    node.meta[i] = Bvh8Node::kInner;
    for (int k = 0; k < 3; ++k) {
      const auto from = static_cast<double>(node.origin[k]);
      const double low = std::floor((boxes[i].min[k] - 0.5 * kRoom - from) / scale);
      const double high = std::ceil((boxes[i].max[k] + 0.5 * kRoom - from) / scale);
      node.lo[k][i] = static_cast<std::uint8_t>(std::max(0.0, low));
      node.hi[k][i] = static_cast<std::uint8_t>(std::min(255.0, high));
    }
  }
  return node;
}

/// Where tiles lie, in tiles, neighbours together (Morton order).
std::vector<std::pair<std::uint32_t, std::uint32_t>> tiles(int across, int along) {
  std::vector<std::pair<std::uint32_t, std::uint32_t>> all;
  const auto spread = [](std::uint32_t x) {
    std::uint64_t bits = 0;
    for (int b = 0; b < 16; ++b) bits |= static_cast<std::uint64_t>(x >> b & 1u) << (2 * b);
    return bits;
  };
  for (int y = 0; y < along; ++y) {
    for (int x = 0; x < across; ++x) all.emplace_back(x, y);
  }
  std::sort(all.begin(), all.end(), [&](const auto& a, const auto& b) {
    return (spread(a.first) | spread(a.second) << 1) < (spread(b.first) | spread(b.second) << 1);
  });
  return all;
}

}  // namespace

std::shared_ptr<const SurfelMap> tiled(const SurfelMap& map, int across, int along) {
  const std::span<const Bvh8Node> nodes = map.nodes();
  const std::span<const SurfelWord> words = map.words();
  const std::size_t used = words.size() - kLeafPadding;
  const double r = map.resolution();
  const Aabb box = box_of(nodes[0]);
  const auto step = [&](int axis) {
    return static_cast<std::uint32_t>(
               std::ceil((box.max[axis] - std::max(0.0, box.min[axis])) / r)) +
           2;
  };
  const std::uint32_t step_x = step(0);
  const std::uint32_t step_y = step(1);
  const auto all = tiles(across, along);
  // levels above the tiles' roots, the root first
  std::vector<std::size_t> sizes{all.size()};
  while (sizes.back() > 1) sizes.push_back((sizes.back() + 7) / 8);
  std::reverse(sizes.begin(), sizes.end());
  std::vector<std::size_t> starts;
  std::size_t above = 0;
  for (const std::size_t size : sizes) {
    starts.push_back(above);
    above += size;
  }
  Scratch scratch;
  Bvh8 tree;
  tree.nodes = ScratchArray<Bvh8Node>(scratch, above + all.size() * (nodes.size() - 1));
  tree.words = ScratchArray<SurfelWord>(scratch, all.size() * used + kLeafPadding);
  for (std::size_t t = 0; t < all.size(); ++t) {
    const std::uint32_t x = all[t].first * step_x;
    const std::uint32_t y = all[t].second * step_y;
    const std::size_t first_node = above + t * (nodes.size() - 1);
    for (std::size_t i = 0; i < nodes.size(); ++i) {
      Bvh8Node node = nodes[i];
      node.origin[0] = static_cast<float>(static_cast<double>(node.origin[0]) + x * r);
      node.origin[1] = static_cast<float>(static_cast<double>(node.origin[1]) + y * r);
      node.first_inner = static_cast<std::uint32_t>(first_node + node.first_inner - 1);
      node.first_leaf_word += static_cast<std::uint32_t>(t * used);
      tree.nodes[i == 0 ? starts.back() + t : first_node + i - 1] = node;
    }
    SurfelWord* const own = tree.words.data() + t * used;
    for (std::size_t w = 0; w < used;) {
      const LeafHeader leaf = decode_leaf(words[w]);
      own[w] = encode(LeafHeader{leaf.x + x, leaf.y + y, leaf.z, leaf.count});
      std::copy_n(words.data() + w + 1, leaf.count, own + w + 1);
      w += leaf.count + 1;
    }
  }
  for (std::size_t level = sizes.size() - 1; level-- > 0;) {
    for (std::size_t i = 0; i < sizes[level]; ++i) {
      const std::size_t first = starts[level + 1] + 8 * i;
      const std::size_t count = std::min<std::size_t>(8, sizes[level + 1] - 8 * i);
      tree.nodes[starts[level] + i] = parent_of(tree.nodes.data() + first, count, first);
    }
  }
  MapDescription description;
  static_cast<MapProperties&>(description) = map.properties();
  description.surfel_count = map.surfel_count() * all.size();
  description.bounds_world.max +=
      Vector3d((across - 1) * step_x * r, (along - 1) * step_y * r, 0.0);
  description.metadata = "{}";
  return SurfelMap::from_bytes(map_bytes(tree, description), "tiles");
}

}  // namespace pointflight
