#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <vector>

#include "pointflight/map/surfel_map.hpp"

namespace pointflight {

/// A map in pieces that a page asks for as it needs them: some thousand surfels each, in the order
/// of the map's file, which is one of space, each in four levels of detail. Made of the mapped file
/// when they are asked for; what is kept is a box for each. All numbers are little endian. Callable
/// from several threads.
class MapBlocks {
 public:
  static constexpr std::size_t kSurfels = 8192;  ///< Of a block, about.
  static constexpr int kLevels = 4;  ///< 0: all surfels; each has a quarter of the last.

  /// Looks at the map when it is first asked for something.
  explicit MapBlocks(std::shared_ptr<const SurfelMap> map) : map_(std::move(map)) {}

  /// How many there are.
  [[nodiscard]] std::size_t size() const;

  /// u32 'PFB1', blocks, surfels, 1 if there are intensities; f64 origin x, y, z (world, m),
  /// resolution (m); f32 intensity of code 0, of a step; then for each block f32 box low x, y, z,
  /// high x, y, z (from the origin, m), u32 surfels.
  [[nodiscard]] std::vector<std::byte> index() const;

  /// A block at a level: u32 surfels, low corner x, y, z (voxels from the origin); then for each
  /// u32 low, high half of the surfel's word, u16 x, y, z of its leaf from the low corner (voxels),
  /// u16 intensity (a code). Empty if there is no such block or level.
  [[nodiscard]] std::vector<std::byte> block(std::size_t number, int level) const;

  /// All blocks one after the other, thinned so that there are about `most` surfels, u32 1 / share
  /// first.
  [[nodiscard]] std::vector<std::byte> overview(std::size_t most) const;

 private:
  struct Block {
    std::uint32_t first_word, end_word;  ///< From a leaf's header to before another.
    std::uint32_t surfels;
    std::array<std::uint32_t, 3> low, high;  ///< Leaves' origins, voxels.
  };
  const std::vector<Block>& blocks() const;
  void append(const Block& block, std::size_t stride, std::vector<std::byte>& out) const;

  std::shared_ptr<const SurfelMap> map_;
  mutable std::once_flag looked_;
  mutable std::vector<Block> blocks_;
};

}  // namespace pointflight
