#include "pointflight/survey/time_unit.hpp"

#include <fmt/format.h>

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

namespace {

const char* name_of_unit(double seconds) {
  for (const TimeUnit& unit : kTimeUnits) {
    if (unit.seconds == seconds) return unit.name;
  }
  return "";
}

}  // namespace

SettledUnit settled_unit(double span,
                         double assumed,
                         double interval,
                         const std::optional<TimeUnit>& given,
                         const std::string& name) {
  SettledUnit settled;
  settled.seconds = given ? given->seconds : assumed;
  if (span == 0.0 || !(interval > 0.0) || fits_interval(span * settled.seconds, interval)) {
    return settled;
  }
  const auto found = given ? std::nullopt : unit_by_span(span, interval);
  if (found) settled.seconds = found->seconds;
  settled.said = fmt::format(
      "{}: times of points are taken to be in {}: a scan takes {:.3g} s so, and scans come every "
      "{:.3g} s{}; --time-unit says otherwise",
      name,
      name_of_unit(settled.seconds),
      span * settled.seconds,
      interval,
      found ? "" : ", surfaces may smear");
  return settled;
}

}  // namespace pointflight
