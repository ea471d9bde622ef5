#pragma once

#include <cstdint>

#include "pointflight/geometry/types.hpp"

namespace pointflight {

/// Anisotropic Gaussian that stands for the surface within one voxel of the map.
///
/// Axes are the columns of `axes`: column 0 is the normal. Standard deviations in units of the
/// voxel size r, s[0] <= s[1] <= s[2].
struct Surfel {
  Vector3f center_voxels;                  ///< From the leaf's origin, in voxels, each in [0, 16).
  Matrix3f axes = Matrix3f::Identity();    ///< Orthonormal, of either hand.
  Vector3f s = Vector3f::Constant(0.29f);  ///< Those of a filled cell: r / sqrt(12).
};

/// A surfel in 8 bytes, low bits first:
///   0-29  x, y, z, 10 bits each: (k + 0.5) / 64 voxels from the leaf's origin
///  30-31  s0 class: {0.005, 0.06, 0.14, 0.27} r
///  32-55  qx, qy, qz, int8: k * 0.70711 / 127; qw = sqrt(max(0, 1 - x^2 - y^2 - z^2))
///  56-58  s1 / s2 = 0.75^k
///  59-63  s2: variance as float bits 0x3b6bedfa + k * 0x288000, times r^2 (0.06 r to 1.8 r)
/// An ellipsoid is unchanged by half turns about its axes, so one of four equivalent quaternions
/// has w as its largest part: no index bits are needed.
using SurfelWord = std::uint64_t;

/// s0 of a planar surfel: its hit lies within 0.005 r of the plane even at grazing angles.
inline constexpr float kPlanarThickness = 0.005f;
/// s0 of each class, in units of r.
inline constexpr float kThicknessClasses[4] = {kPlanarThickness, 0.06f, 0.14f, 0.27f};

/// Steps of s1 and s2 start here, in units of r.
inline constexpr float kMinSpread = 0.06f;

/// What eight bytes can say of it: the nearest, but for planar ones (thickness class 0), which may
/// lie a step beside that within their plane and be turned by some degrees about their normal so
/// that plane and normal are the best. `center_voxels` must lie in [0, 16).
SurfelWord encode(const Surfel& surfel);
/// Axes come out as one of four that stand for the same ellipsoid.
Surfel decode(SurfelWord word);

/// The centre alone, as `decode` has it: from the leaf's origin, in voxels.
inline Vector3f center_voxels(SurfelWord word) {
  const auto part = [word](int axis) {
    return (static_cast<float>((word >> (10 * axis)) & 1023u) + 0.5f) / 64.0f;
  };
  return {part(0), part(1), part(2)};
}

/// True for surfels of thickness class 0.
inline bool is_planar(SurfelWord word) {
  return ((word >> 30) & 3u) == 0;
}

/// First word of a leaf: 20-bit voxel coordinates of its origin and the number of surfels (1..8).
struct LeafHeader {
  /// Voxels from the map's origin.
  ///@{
  std::uint32_t x, y, z;
  ///@}
  std::uint32_t count;  ///< Surfels that follow, 1 to 8.
};
/// Coordinates below 2^20.
inline SurfelWord encode(const LeafHeader& leaf) {
  return static_cast<SurfelWord>(leaf.x) | static_cast<SurfelWord>(leaf.y) << 20 |
         static_cast<SurfelWord>(leaf.z) << 40 | static_cast<SurfelWord>(leaf.count) << 60;
}
/// Of any word, also one that is no header: counts up to 15.
inline LeafHeader decode_leaf(SurfelWord word) {
  constexpr std::uint32_t kMask = (1u << 20) - 1;
  return {static_cast<std::uint32_t>(word) & kMask,
          static_cast<std::uint32_t>(word >> 20) & kMask,
          static_cast<std::uint32_t>(word >> 40) & kMask,
          static_cast<std::uint32_t>(word >> 60)};
}

}  // namespace pointflight
