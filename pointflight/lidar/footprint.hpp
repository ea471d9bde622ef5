// How wide a sensor's beams are.
#pragma once

#include <cstddef>
#include <span>

#include "pointflight/lidar/lidar_settings.hpp"
#include "pointflight/render/wide_beams.hpp"

namespace pointflight {

/// A beam's cross-section, from its divergence: sigma = full angle at half maximum / 2.3548.
class Footprint {
 public:
  /// Of a sensor without divergence beams are lines.
  explicit Footprint(const OpticsSettings& optics);

  /// True if beams are lines.
  [[nodiscard]] bool is_line() const { return sub_rays_ == 1; }
  /// Beams as wide, for a renderer. `across`: of each, the horizontal of the sensor across it, unit
  /// vectors in the world; all that they refer to must outlive them.
  [[nodiscard]] WideBeams beams(std::span<const Vector3f> across,
                                const EchoReceiver& receiver,
                                std::span<Echoes> echoes) const;

 private:
  std::size_t sub_rays_;
  float sigma_across_, sigma_up_;  ///< rad
  float merge_;                    ///< Half a pulse, m.
};

}  // namespace pointflight
