#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "pointflight/map/surfel_map.hpp"
#include "pointflight/map/surfel_scale.hpp"
#include "pointflight/render/internal/map_ray.hpp"

namespace pointflight {

/// Numbers of the map that every beam needs.
struct KernelMap {
  const Bvh8Node* nodes = nullptr;
  std::size_t node_count = 0;
  const SurfelWord* words = nullptr;
  std::size_t word_count = 0;
  double origin[3] = {0, 0, 0};  ///< World position of voxel (0, 0, 0), m.
  double resolution = 0.0;
  float r = 0.0f;                ///< The same.
  float support = 0.0f;          ///< M
  float support_squared = 0.0f;  ///< M^2
  float inverse_support = 0.0f;  ///< 1 / M^2
  float weight_scale = 0.0f;     ///< Weight of a hit in the middle, in steps of kWeightOne.
  SurfelScale scale;
  float window = 0.0f;   ///< m
  std::int32_t tau = 0;  ///< In steps of kWeightOne.
  /// Groups of eight beams that are wider (radius, rad) hit so many surfels apart that bundles are
  /// faster than packets: in proportion to r up to a limit, measured from 0.02 to 0.2 m.
  float widest_group = 0.0f;
};

/// Weights are whole numbers of 2^-20: their sums do not depend on the order of adding.
inline constexpr float kWeightOne = 1048576.0f;
/// Shares of a window's depth and of cosines are whole numbers of 1 / 4096, likewise.
inline constexpr float kShareSteps = 4096.0f;

/// What a beam hit, before intensities are looked up.
struct KernelHit {
  float range = -1.0f;  ///< m; negative if nothing was hit.
  float cos_incidence = 0.0f;
  std::uint32_t strongest = 0;  ///< Word of the surfel with the largest weight.
};

/// Which beams go through the tree together.
enum class BeamGrouping {
  kAutomatic,  ///< Close ones as packets, others as bundles or by themselves, whatever is faster.
  kSingly,     ///< Each by itself.
  kBundles,    ///< Bundles wherever 64 neighbours lie within 0.4 rad.
};

KernelMap kernel_map_of(const SurfelMap& map);

/// Traces the rays `order[0..]` of `rays` and writes `hits[order[i]]`, by the best kernel for this
/// processor: AVX-512, AVX2, SSE4 or NEON. The results are the same bits on all of them, whatever
/// the order, whatever else is traced in the same call, and however beams are grouped: neighbours
/// in `order` go together. Returns how many beams hit more surfels than fit in their list
/// (docs/architecture.md, "Hit rule").
std::uint64_t trace_beams(const KernelMap& map,
                          std::span<const MapRay> rays,
                          std::span<const std::uint32_t> order,
                          std::span<KernelHit> hits,
                          BeamGrouping grouping = BeamGrouping::kAutomatic);

/// Names of the kernels that this processor can run, the best first.
std::vector<std::string> kernel_names();

/// From now on this kernel is used ("" = the best): for tests and measurements, not thread-safe.
/// Throws InputError that lists the names.
void use_kernel(const std::string& name);

}  // namespace pointflight
