// The unit that times of points are in, which files do not say.
#pragma once

#include <array>
#include <optional>
#include <string>

namespace pointflight {

/// A unit of time that drivers use.
struct TimeUnit {
  const char* name = "s";  ///< As --time-unit has it.
  double seconds = 1.0;    ///< Of one.
};

/// All of them.
inline constexpr std::array<TimeUnit, 4> kTimeUnits = {
    {{"s", 1.0}, {"ms", 1e-3}, {"us", 1e-6}, {"ns", 1e-9}}};

/// True if a scan's points that are measured over `span` s may be of scans that come every
/// `interval` s: they take between a thirtieth and one and a half of it.
bool fits_interval(double span, double interval);

/// The unit in which the times of a scan's points span what they should.
/// @param span      From the first to the last, in the file's unit.
/// @param interval  From scan to scan, s.
/// @return Nothing if they fit in none.
std::optional<TimeUnit> unit_by_span(double span, double interval);

/// The unit that times of points are read in, and what users are told of it.
struct SettledUnit {
  double seconds = 1.0;  ///< Of one.
  std::string said;      ///< A line; empty if a scan takes as long as it should.
};
/// @param span      From the first to the last time of a usual scan, in the file's unit; 0: they
///                  have none.
/// @param assumed   Of the file's unit by its type, s.
/// @param interval  From scan to scan, s; NaN: not known.
/// @param given     By the user; nothing: it is recognised.
/// @param name      Of the scans, for the line.
SettledUnit settled_unit(double span,
                         double assumed,
                         double interval,
                         const std::optional<TimeUnit>& given,
                         const std::string& name);

}  // namespace pointflight
