// Beams as wide as a sensor's are, and what its receiver makes of the light that comes back.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "pointflight/geometry/types.hpp"
#include "pointflight/render/echoes.hpp"
#include "pointflight/render/hit.hpp"

namespace pointflight {

/// Reflectivities of a map's surfaces, before the cosine of the incidence.
struct Reflectances {
  float per_intensity = 0.0f;    ///< Of one unit of the map's intensity; counts if it is above 0.
  float same = 0.0f;             ///< Else all have it, if it is above 0.
  const float* usual = nullptr;  ///< Else a surfel has `usual[usual_number(surfel)]`, of 4,096.
  float least = 0.0f;            ///< Of any surface, the cosine included.
};

/// Factor of a multiplicative hash (Knuth, The Art of Computer Programming, vol. 3, 6.4).
inline constexpr std::uint32_t kUsualFactor = 2654435769u;
/// Which of 4,096 reflectivities a surfel has if nothing is known of it: always the same.
constexpr std::uint32_t usual_number(std::uint32_t surfel) {
  return (surfel * kUsualFactor) >> 20;
}

/// Reflectivities (`Echo::reflectivity`) above which echoes are reported for certain, by steps of
/// range from 0 m on; the last one goes for all that is farther.
struct SureEchoes {
  std::span<const float> reflectivities;  ///< Empty: any echo is.
  float steps_per_m = 0.0f;               ///< How many steps a metre has.
};

/// What echoes are to a sensor. Asked from any thread.
class EchoReceiver {
 public:
  virtual ~EchoReceiver() = default;
  /// Of what a ray hit: its reflectivity times the cosine of the incidence.
  [[nodiscard]] virtual double reflectivity(const Hit& hit) const = 0;
  /// The same of a map's surfaces.
  [[nodiscard]] virtual Reflectances reflectances() const = 0;
  /// True if scaling the echo's energy by `less` or `more` changes whether it is reported.
  [[nodiscard]] virtual bool is_marginal(const Echo& echo, double less, double more) const = 0;
  /// Echoes that are not marginal even if their energy is off by a quarter.
  [[nodiscard]] virtual SureEchoes sure_echoes() const { return {}; }
  /// True if one echo of a beam is reported, the strongest.
  [[nodiscard]] virtual bool takes_strongest() const = 0;
};

/// Beams with a cross-section: an elliptical Gaussian, truncated where its density falls to 1 / e^2
/// of the centre's (2 sigma), which optics calls the beam's radius.
struct WideBeams {
  /// Of each ray, which is its beam's axis, the direction across it in which sigma is
  /// `sigma_across`: unit vectors in the world. Empty of aimed beams: `make_across`.
  std::span<const Vector3f> across;
  float sigma_across = 0.0f;  ///< rad
  float sigma_up = 0.0f;      ///< Across both the ray and `across`, rad.
  float merge = 0.0f;         ///< Parts that follow each other within it are one echo, m.
  /// So many rays over each cross-section; 0: as many as it takes.
  std::size_t sub_rays = 0;
  const EchoReceiver* receiver = nullptr;  ///< Never null.
  std::span<Echoes> echoes;                ///< Of each ray, written.
};

}  // namespace pointflight
