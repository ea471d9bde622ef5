// How a spinning sensor turns and what its channels are, from its scans.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "pointflight/survey/scan_source.hpp"

namespace pointflight {

/// One channel of a spinning sensor.
struct RingFit {
  std::int32_t ring = 0;            ///< As the recording numbers it.
  double elevation_deg = 0.0;       ///< Median.
  double azimuth_offset_deg = 0.0;  ///< After the first ring's, counter-clockwise seen from above.
  double fire_time_us = 0.0;        ///< After the first to fire of a cycle.
  double range_offset = 0.0;        ///< Mean of range minus the patches' planes, m.
  std::size_t points = 0;           ///< That it has.
};

/// How a sensor turns.
struct TurnFit {
  double rate = 0.0;           ///< Turns per second.
  bool is_clockwise = true;    ///< Seen from above.
  double cycle_us = 0.0;       ///< From one firing of a channel to the next.
  std::vector<RingFit> rings;  ///< By ascending number.
};

/// Of scans whose points have rings and times; nothing if azimuths do not go on evenly with
/// time, or rings are not level. A cycle begins after its longest pause; range offsets are left at
/// 0.
std::optional<TurnFit> fit_turn(std::span<const RecordedScan> scans);

/// The rings as a table for a sensor file with `convention: velodyne`: ring, elevation_deg,
/// azimuth_offset_deg, fire_time_us.
std::string rings_csv(const TurnFit& turn);

}  // namespace pointflight
