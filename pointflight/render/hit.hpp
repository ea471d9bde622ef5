#pragma once

#include <cstdint>

#include "pointflight/map/body.hpp"

namespace pointflight {

/// No surfel of the map.
inline constexpr std::uint32_t kNoSurfel = 0xffffffffu;

/// What a ray hit.
struct Hit {
  float range = -1.0f;         ///< Metres along the ray; negative if it hit nothing.
  float cos_incidence = 0.0f;  ///< |cos| of the angle between the ray and the surface normal.
  float intensity = 0.0f;      ///< The cloud's own scale; 0 if it had none.
  Label label = kMapLabel;     ///< What it is of.
  /// Of the map, which gave most of the return: its index in `SurfelMap::words()`; `kNoSurfel` of
  /// bodies and where the renderer does not say.
  std::uint32_t surfel = kNoSurfel;
  /// False: it hit nothing within its range.
  [[nodiscard]] bool is_return() const { return range >= 0.0f; }
};

}  // namespace pointflight
