#pragma once

#include <cstdint>
#include <vector>

#include "pointflight/map/surfel.hpp"

namespace pointflight {

/// Inner node with up to eight children, 80 bytes. Child box = origin + scale * q (lo rounded down,
/// hi up), metres from the map's origin. Inner children are consecutive from `first_inner`; leaves
/// are consecutive from word `first_leaf_word`, in lane order.
struct alignas(16) Bvh8Node {
  float origin[3];
  float scale;
  std::uint32_t first_inner;
  std::uint32_t first_leaf_word;
  std::uint8_t meta[8];  ///< 0 empty, kInner, or the number of surfels of a leaf (1..8).
  std::uint8_t lo[3][8];
  std::uint8_t hi[3][8];

  static constexpr std::uint8_t kInner = 0x80;
};
static_assert(sizeof(Bvh8Node) == 80);

/// Words behind the last leaf that a reader may touch.
inline constexpr std::size_t kLeafPadding = 8;

/// Half width, in standard deviations, of the ellipsoid outside which a surfel has no weight.
inline constexpr float kSupport = 3.8f;

/// One surfel on its way into the tree.
struct BuildSurfel {
  std::uint64_t morton = 0;  ///< Of its voxel; the input is sorted by it and has no equal ones.
  Vector3f center_in_voxel;  ///< In voxels, each in [0, 1).
  Matrix3f axes;
  Vector3f s;  ///< Standard deviations in units of r.
  std::uint8_t intensity = 0;
};

struct Bvh8 {
  std::vector<Bvh8Node> nodes;
  std::vector<SurfelWord> words;        ///< Leaf header and surfels, plus kLeafPadding.
  std::vector<std::uint8_t> intensity;  ///< Beside `words`, one byte a word.
  Aabb bounds;                          ///< Of the support ellipsoids, metres from the origin.
};

/// How much work goes into the tree: `kHigh` makes rays faster and the build slower.
enum class TreeQuality { kNormal, kHigh };

/// Builds the hierarchy over surfels sorted by Morton code: a node starts with its range and splits
/// the child with the most surfels at its highest differing key bit until it has eight children;
/// eight surfels or fewer within 13 voxels make a leaf. `kHigh` opens the child with the largest
/// box and splits where the surface area heuristic says. `resolution` is r in metres.
Bvh8 build_bvh8(const std::vector<BuildSurfel>& surfels,
                double resolution,
                TreeQuality quality = TreeQuality::kNormal);

}  // namespace pointflight
