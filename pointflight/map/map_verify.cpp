#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <vector>

#include "pointflight/core/hash.hpp"
#include "pointflight/core/input_error.hpp"
#include "pointflight/io/byte_cursor.hpp"
#include "pointflight/map/map_file.hpp"
#include "pointflight/map/surfel_map.hpp"

namespace pointflight {

void SurfelMap::verify() const {
  const auto fail = [&](std::string_view section, const std::string& what) {
    throw InputError(
        fmt::format("{}: section '{}': {}; import the cloud again", name_, excerpt(section), what));
  };
  for (const MapSection& s : sections_) {
    if (hash64(bytes_.subspan(s.offset, s.size)) != s.checksum) {
      fail(section_name(s),
           fmt::format("the checksum of its {} bytes at {} does not match", s.size, s.offset));
    }
  }
  const std::size_t usable_words = words_.size() - kLeafPadding;
  // each node but the first is the child of one other
  std::vector<bool> is_child(nodes_.size());
  std::uint64_t surfels = 0;
  for (std::size_t n = 0; n < nodes_.size(); ++n) {
    const Bvh8Node& node = nodes_[n];
    std::size_t inner = node.first_inner;
    std::size_t word = node.first_leaf_word;
    for (const std::uint8_t meta : node.meta) {
      if (meta == Bvh8Node::kInner) {
        if (inner <= n || inner >= nodes_.size()) {
          fail("nodes", fmt::format("node {} points to node {}", n, inner));
        }
        if (is_child[inner]) fail("nodes", fmt::format("two nodes point to node {}", inner));
        is_child[inner] = true;
        ++inner;
      } else if (meta > 8) {
        fail("nodes", fmt::format("node {} has a child of kind {}", n, meta));
      } else if (meta > 0) {
        if (word + meta >= usable_words || decode_leaf(words_[word]).count != meta) {
          fail("words", fmt::format("node {} points to a leaf at word {}", n, word));
        }
        word += meta + 1u;
        surfels += meta;
      }
    }
    const bool is_box = std::all_of(
        std::begin(node.origin), std::end(node.origin), [](float x) { return std::isfinite(x); });
    if (!is_box || !std::isfinite(node.scale) || !(node.scale > 0.0f)) {
      fail("nodes", fmt::format("node {} has no size", n));
    }
    if (n > 0 && !is_child[n]) fail("nodes", fmt::format("no node points to node {}", n));
  }
  if (surfels != properties_.surfel_count) {
    fail("words",
         fmt::format("{} surfels where the header says {}", surfels, properties_.surfel_count));
  }
}

}  // namespace pointflight
