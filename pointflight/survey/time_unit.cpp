#include "pointflight/survey/time_unit.hpp"

namespace pointflight {

bool fits_interval(double span, double interval) {
  // units are a thousand apart: one of them at most fits
  return span >= interval / 30.0 && span <= 1.5 * interval;
}

std::optional<TimeUnit> unit_by_span(double span, double interval) {
  for (const TimeUnit& unit : kTimeUnits) {
    if (fits_interval(span * unit.seconds, interval)) return unit;
  }
  return std::nullopt;
}

}  // namespace pointflight
