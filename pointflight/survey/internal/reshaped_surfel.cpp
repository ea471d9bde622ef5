#include "pointflight/survey/internal/reshaped_surfel.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace pointflight {
namespace {

constexpr SurfelWord kCenterBits = (SurfelWord{1} << 30) - 1;
constexpr float kWidest = 1.8f;           // r: what eight bytes can say
constexpr float kThinnestVolume = 0.06f;  // r: above the planar class
constexpr float kFromFace = 0.002f;       // voxels, less than half a step of a centre

/// The surfel's centre moved, as far as its voxel reaches: a planar one stays in its plane.
Vector3f shifted_center(const Surfel& surfel, const std::array<double, 3>& shifts) {
  Vector3f way = Vector3f::Zero();
  for (int k = 0; k < 3; ++k) {
    way +=
        static_cast<float>(shifts[static_cast<std::size_t>(k)]) * surfel.s[k] * surfel.axes.col(k);
  }
  float share = 1.0f;
  for (int k = 0; k < 3; ++k) {
    if (way[k] == 0.0f) continue;
    const float low = std::floor(surfel.center_voxels[k]);
    const float face = way[k] > 0.0f ? low + 1.0f - kFromFace : low + kFromFace;
    share = std::min(share, std::max(0.0f, (face - surfel.center_voxels[k]) / way[k]));
  }
  return surfel.center_voxels + share * way;
}

}  // namespace

SurfelWord reshaped(SurfelWord word, const Reshaping& change) {
  if (change == Reshaping{}) return word;  // encoding would round the axes
  Surfel surfel = decode(word);
  const bool is_shifted = change.shifts != Reshaping{}.shifts;
  // any that is not shifted: the old one is put back
  surfel.center_voxels =
      is_shifted ? shifted_center(surfel, change.shifts) : Vector3f::Constant(0.5f);
  for (int k = 0; k < 3; ++k) {
    surfel.s[k] *= static_cast<float>(change.factors[static_cast<std::size_t>(k)]);
  }
  if (surfel.s[1] > surfel.s[2]) {
    std::swap(surfel.s[1], surfel.s[2]);
    const Vector3f axis = surfel.axes.col(1);
    surfel.axes.col(1) = surfel.axes.col(2);
    surfel.axes.col(2) = axis;
  }
  for (const int k : {1, 2}) surfel.s[k] = std::clamp(surfel.s[k], kMinSpread, kWidest);
  surfel.s[0] =
      is_planar(word) ? kPlanarThickness : std::clamp(surfel.s[0], kThinnestVolume, surfel.s[1]);
  const SurfelWord encoded = encode(surfel);
  return is_shifted ? encoded : (encoded & ~kCenterBits) | (word & kCenterBits);
}

}  // namespace pointflight
