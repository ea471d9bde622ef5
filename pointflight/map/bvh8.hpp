#pragma once

#include <array>
#include <cstdint>

#include "pointflight/core/parallel.hpp"
#include "pointflight/core/scratch.hpp"
#include "pointflight/map/surfel.hpp"

namespace pointflight {

/// Inner node with up to eight children, 80 bytes. Child box = origin + scale * q (lo rounded down,
/// hi up), metres from the map's origin. Inner children are consecutive from `first_inner`; leaves
/// are consecutive from word `first_leaf_word`, in lane order.
struct alignas(16) Bvh8Node {
  float origin[3];                ///< Low corner of its box, m from the map's origin.
  float scale;                    ///< Metres of one step of lo and hi, the same on all axes.
  std::uint32_t first_inner;      ///< Index of its first inner child in `Bvh8::nodes`.
  std::uint32_t first_leaf_word;  ///< Index of its first leaf's header in `Bvh8::words`.
  std::uint8_t meta[8];           ///< 0 empty, kInner, or the number of surfels of a leaf (1..8).
  std::uint8_t lo[3][8];          ///< Low corners of the children, by axis and lane.
  std::uint8_t hi[3][8];          ///< High corners of the children, by axis and lane.

  static constexpr std::uint8_t kInner = 0x80;  ///< Of `meta`: the child is a node.
};
static_assert(sizeof(Bvh8Node) == 80);

/// Words behind the last leaf that a reader may touch.
inline constexpr std::size_t kLeafPadding = 8;

/// Half width, in standard deviations, of the ellipsoid outside which a surfel has no weight.
inline constexpr float kSupport = 3.7f;

/// Input of the tree builder: one surfel.
struct BuildSurfel {
  std::uint64_t morton = 0;  ///< voxel_key of its voxel; the input ascends by it, at most eight
                             ///< surfels alike.
  SurfelWord word = 0;       ///< With its centre in voxels from the voxel's low corner, in [0, 1].
};

/// Box around the centres of surfels, m; `base_world`: corner of voxel (0, 0, 0).
Aabb bounds_of(std::span<const BuildSurfel> surfels, const Vector3d& base_world, double resolution);

/// A hierarchy over surfels as a map's file holds it; the first node is the root.
struct Bvh8 {
  ScratchArray<Bvh8Node> nodes;          ///< Inner nodes; the root first.
  ScratchArray<SurfelWord> words;        ///< Leaf header and surfels, plus kLeafPadding.
  ScratchArray<std::uint8_t> intensity;  ///< Beside `words`, one byte a word; empty without.
};

/// How much work goes into the tree: `kHigh` makes rays faster and the build slower.
enum class TreeQuality { kNormal, kHigh };

/// What a tree is built of.
struct TreeInput {
  const ScratchArray<BuildSurfel>& surfels;     ///< In Morton order.
  const ScratchArray<std::uint8_t>& intensity;  ///< Beside them, or empty.
  std::array<std::uint32_t, 3> low{};           ///< Decoded key that becomes voxel (0, 0, 0).
  double resolution = 1.0;                      ///< r, m.
};

/// Builds the hierarchy over surfels sorted by Morton code: a node starts with its range and splits
/// the child with the most surfels at its highest differing key bit until it has eight children;
/// eight surfels or fewer within 13 voxels make a leaf. `kHigh` does so down to about 100,000
/// surfels, and below opens the child with the largest box and splits if the surface area
/// heuristic says. Does not depend on threads.
Bvh8 build_bvh8(const TreeInput& input,
                TreeQuality quality,
                const Executor& executor,
                Scratch& scratch);

}  // namespace pointflight
