#include "pointflight/view/map_blocks.hpp"

#include <algorithm>
#include <cstring>
#include <limits>

namespace pointflight {
namespace {

constexpr std::uint32_t kMagic = 0x31424650;  // 'PFB1'
constexpr std::uint32_t kWidest = 65000;      // voxels that a block may span: rows have 16 bits
constexpr float kLeafVoxels = 16.0f;          // that centres lie within from a leaf's origin

/// As it lies in memory here, which is little endian on every processor that we build for.
template <class T>
void put(std::vector<std::byte>& out, const T& value) {
  const auto* bytes = reinterpret_cast<const std::byte*>(&value);
  out.insert(out.end(), bytes, bytes + sizeof value);
}

}  // namespace

/// Leaf by leaf, without their surfels: some milliseconds per million.
const std::vector<MapBlocks::Block>& MapBlocks::blocks() const {
  std::call_once(looked_, [this] {
    const auto words = map_->words();
    constexpr std::uint32_t kMost = std::numeric_limits<std::uint32_t>::max();
    const Block empty{0, 0, 0, {kMost, kMost, kMost}, {0, 0, 0}};
    Block block = empty;
    for (std::size_t at = 0; at + kLeafPadding < words.size();) {
      const LeafHeader leaf = decode_leaf(words[at]);
      const std::array<std::uint32_t, 3> place = {leaf.x, leaf.y, leaf.z};
      Block with = block;
      for (std::size_t k = 0; k < 3; ++k) {
        with.low[k] = std::min(with.low[k], place[k]);
        with.high[k] = std::max(with.high[k], place[k]);
      }
      const bool is_wide = with.high[0] - with.low[0] > kWidest ||
                           with.high[1] - with.low[1] > kWidest ||
                           with.high[2] - with.low[2] > kWidest;
      if (block.surfels > 0 && (is_wide || block.surfels >= kSurfels)) {
        blocks_.push_back(block);
        block = empty;
        block.first_word = static_cast<std::uint32_t>(at);
        with = block;
        with.low = with.high = place;
      }
      block = with;
      block.surfels += std::min<std::uint32_t>(leaf.count, kLeafPadding);
      at = std::min(at + leaf.count + 1, words.size() - kLeafPadding);
      block.end_word = static_cast<std::uint32_t>(at);
    }
    if (block.surfels > 0) blocks_.push_back(block);
  });
  return blocks_;
}

std::size_t MapBlocks::size() const {
  return blocks().size();
}

std::vector<std::byte> MapBlocks::index() const {
  std::vector<std::byte> out;
  put(out, kMagic);
  put(out, static_cast<std::uint32_t>(blocks().size()));
  put(out, static_cast<std::uint32_t>(map_->surfel_count()));
  put(out, static_cast<std::uint32_t>(map_->has_intensity() ? 1 : 0));
  for (int axis = 0; axis < 3; ++axis) put(out, map_->origin_world()[axis]);
  put(out, map_->resolution());
  // as if steps were equal: bright outliers are white
  const IntensityLevels& levels = map_->intensity_levels();
  put(out, levels.of_code[0]);
  put(out, levels.is_linear ? levels.step : levels.of_code[1] - levels.of_code[0]);
  const auto r = static_cast<float>(map_->resolution());
  for (const Block& block : blocks()) {
    for (std::size_t k = 0; k < 3; ++k) put(out, r * static_cast<float>(block.low[k]));
    for (std::size_t k = 0; k < 3; ++k) {
      put(out, r * (static_cast<float>(block.high[k]) + kLeafVoxels));
    }
    put(out, block.surfels);
  }
  return out;
}

/// Each `stride`-th surfel of a block.
void MapBlocks::append(const Block& block, std::size_t stride, std::vector<std::byte>& out) const {
  const std::size_t head = out.size();
  put(out, std::uint32_t{0});
  for (const std::uint32_t low : block.low) put(out, low);
  const auto words = map_->words();
  const auto codes = map_->intensity_codes();
  std::size_t number = 0;
  std::uint32_t count = 0;
  for (std::size_t at = block.first_word; at < block.end_word;) {
    const LeafHeader leaf = decode_leaf(words[at]);
    for (std::size_t i = 1; i <= leaf.count && at + i < block.end_word; ++i) {
      if (number++ % stride != 0) continue;
      ++count;
      put(out, words[at + i]);
      put(out, static_cast<std::uint16_t>(leaf.x - block.low[0]));
      put(out, static_cast<std::uint16_t>(leaf.y - block.low[1]));
      put(out, static_cast<std::uint16_t>(leaf.z - block.low[2]));
      put(out, static_cast<std::uint16_t>(at + i < codes.size() ? codes[at + i] : 0));
    }
    at += leaf.count + 1;
  }
  std::memcpy(out.data() + head, &count, sizeof count);
}

std::vector<std::byte> MapBlocks::block(std::size_t number, int level) const {
  std::vector<std::byte> out;
  if (number >= blocks().size() || level < 0 || level >= kLevels) return out;
  append(blocks()[number], std::size_t{1} << (2 * level), out);
  return out;
}

std::vector<std::byte> MapBlocks::overview(std::size_t most) const {
  std::vector<std::byte> out;
  const std::size_t surfels = map_->surfel_count();
  const std::size_t stride = std::max<std::size_t>(1, surfels / std::max<std::size_t>(1, most));
  put(out, static_cast<std::uint32_t>(stride));
  for (const Block& block : blocks()) append(block, stride, out);
  return out;
}

}  // namespace pointflight
