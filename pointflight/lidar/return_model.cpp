#include "pointflight/lidar/return_model.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "pointflight/core/constants.hpp"
#include "pointflight/core/math.hpp"

namespace pointflight {
namespace {

constexpr double kDarkest = 1e-3;                   // reflectivity of anything
constexpr double kNearest = 0.01;                   // m, of signals
constexpr double kBrightest = 255.0;                // a byte, in every maker's packets
constexpr double kUsualDivergence = 0.2 * kDegree;  // rad, where a sensor file gives none

/// Mean full angle of the beam, rad.
double divergence_of(const OpticsSettings& optics) {
  const double mean =
      0.5 * (optics.divergence_horizontal_deg + optics.divergence_vertical_deg) * kDegree;
  return mean > 0.0 ? mean : kUsualDivergence;
}

}  // namespace

void describe(SettingsVisitor& v, Surroundings& s) {
  v.value({"sun_klx", "klx", "background light: 100 in full sun, 0 at night", 0, 200}, s.sun_klx);
  v.value({"reflectivity",
           "",
           "of surfaces of which the map does not say it, at the laser's wavelength",
           0.001,
           1},
          s.reflectivity);
  v.value({"reflectivity_per_intensity",
           "",
           "of the map's surfaces, per unit of its intensity; 0: intensities are not calibrated",
           0,
           1e6},
          s.reflectivity_per_intensity);
  v.section({"weather", "", "what is in the air"},
            [&](SettingsVisitor& w) { describe(w, s.weather); });
}

ReturnModel::ReturnModel(const LidarSettings& lidar, const Surroundings& surroundings)
    : noise_(lidar.noise),
      surroundings_(surroundings),
      detection_(lidar.detection, surroundings.sun_klx),
      reach_(detection_.is_ideal() ? lidar.range_max : detection_.reach()),
      weather_(detection_.is_ideal() ? WeatherSettings{} : surroundings.weather,
               divergence_of(lidar.optics),
               lidar.range_min,
               reach_),
      false_alarm_(detection_.is_ideal() ? 0.0 : lidar.detection.false_alarm),
      intensity_scale_(lidar.detection.intensity_at_100_percent),
      range_min_(lidar.range_min) {}

double ReturnModel::reflectivity_of(const Hit& hit) const {
  double reflectivity = surroundings_.reflectivity;
  if (hit.label == kMapLabel && surroundings_.reflectivity_per_intensity > 0.0) {
    reflectivity = static_cast<double>(hit.intensity) * surroundings_.reflectivity_per_intensity;
  }
  return std::max(kDarkest, reflectivity * static_cast<double>(hit.cos_incidence));
}

double ReturnModel::range_sigma(double range, double margin) const {
  const double far = noise_.range_sigma_per_m2 * range * range;
  const double weak = noise_.range_sigma_at_limit / margin;
  return std::sqrt(noise_.range_sigma * noise_.range_sigma + far * far + weak * weak);
}

float ReturnModel::rounded(double range) const {
  const double step = noise_.range_step;
  if (step > 0.0) range = step * static_cast<double>(floor_to_integer(range / step + 0.5));
  return static_cast<float>(range);
}

/// What fog or a drop before a surface (or within `range`, where there is none) gives, where that
/// is stronger. Its margin is by the pure link budget from the darkest rated target on: sheets say
/// nothing of signals so near and so weak, and their own law, which the sun flattens, would let a
/// sensor see every wisp of haze.
Return ReturnModel::from_air(double strength_of_surface,
                             double range,
                             const BeamChance& chance) const {
  const auto soft = weather_.soft(range, chance.drop, chance.drop_place);
  if (!soft || soft->strength <= strength_of_surface || soft->range < range_min_) return {};
  const double margin = soft->strength / detection_.least_strength();
  if (chance.detection >= detection_.probability(margin)) return {};
  Return made;
  made.range = rounded(soft->range + range_sigma(soft->range, margin) * chance.normal);
  made.is_false = true;
  if (static_cast<double>(made.range) < range_min_) return {};
  const double seen = soft->strength * soft->range * soft->range;  // as reflectivity
  made.intensity = static_cast<float>(std::min(kBrightest, intensity_scale_ * seen));
  return made;
}

Return ReturnModel::measure(const Hit& hit, const BeamChance& chance) const {
  Return made;
  if (chance.detection < false_alarm_) {
    made.range = rounded(range_min_ + (reach_ - range_min_) * chance.place);
    made.is_false = true;
    return made;
  }
  const auto range = static_cast<double>(hit.range);
  double reflectivity = 0.0;
  if (hit.is_return()) reflectivity = reflectivity_of(hit) * weather_.left_after(range);
  if (!weather_.is_clear()) {
    const double near = std::max(range, kNearest);
    const Return air = hit.is_return() ? from_air(reflectivity / (near * near), range, chance)
                                       : from_air(0.0, reach_, chance);
    if (air.range >= 0.0f) return air;
  }
  if (!hit.is_return()) return {};
  double margin = std::numeric_limits<double>::infinity();
  if (!detection_.is_ideal()) {
    margin = detection_.margin(reflectivity, std::max(range, kNearest));
    if (chance.detection >= detection_.probability(margin)) return {};
  }
  made.range = rounded(range + range_sigma(range, margin) * chance.normal);
  if (static_cast<double>(made.range) < range_min_) return {};
  made.intensity = intensity_scale_ > 0.0
                       ? static_cast<float>(std::min(kBrightest, intensity_scale_ * reflectivity))
                       : hit.intensity;
  return made;
}

}  // namespace pointflight
