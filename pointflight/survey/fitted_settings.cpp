// A sensor's settings with the figures of a fit.
#include "pointflight/core/constants.hpp"
#include "pointflight/core/floor.hpp"
#include "pointflight/survey/sensor_fit.hpp"

namespace pointflight {

LidarSettings with_fit(LidarSettings base, const SensorFit& fit, const std::string& rings_table) {
  const auto rounded = [](double value, double step) {
    return step * static_cast<double>(floor_to_integer(value / step + 0.5));
  };
  if (fit.turn) {
    base.rate = rounded(fit.turn->rate, 0.01);
  } else if (fit.rate) {
    base.rate = rounded(*fit.rate, 0.01);
  }
  base.noise.range_sigma = rounded(fit.noise.range.sigma, 1e-4);
  base.noise.range_sigma_per_m2 = 0.0;
  // told if it shows, or if it would have shown
  const FittedSigma& at_limit = fit.noise.at_limit;
  if (at_limit.shows() || at_limit.sigma + 2.0 * at_limit.error < base.noise.range_sigma_at_limit) {
    base.noise.range_sigma_at_limit = rounded(at_limit.sigma, 1e-4);
  }
  if (fit.ring_offset.shows()) base.noise.ring_offset_sigma = rounded(fit.ring_offset.sigma, 1e-4);
  base.noise.range_step = fit.range_step;
  base.optics.angle_sigma_deg = rounded(fit.noise.angle.sigma / kDegree, 1e-4);
  base.grounds.range_noise = Ground::kMeasured;
  base.grounds.direction_noise = Ground::kMeasured;
  if (fit.turn && !rings_table.empty()) {
    base.pattern = ScanPattern::kRings;
    base.grounds.pattern = Ground::kMeasured;
    base.rings = {};
    base.rings.table = rings_table;
    base.rings.cycle_us = rounded(fit.turn->cycle_us, 1e-3);
  }
  return base;
}

}  // namespace pointflight
