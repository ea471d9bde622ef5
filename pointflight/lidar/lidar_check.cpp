// Values of a sensor file that only make sense together.
#include <fmt/format.h>

#include <algorithm>
#include <string>

#include "pointflight/core/input_error.hpp"
#include "pointflight/lidar/lidar_settings.hpp"

namespace pointflight {
namespace {

constexpr double kMostBeams = 16e6;  // a scan
constexpr std::size_t kMostChannels = 1024;

/// Channels come from one of table, list and number.
template <class Fail>
void check_channels(const RingsSettings& s, const Fail& fail) {
  const bool has_list = !s.elevations_deg.empty();
  const int ways = (s.table.empty() ? 0 : 1) + (has_list ? 1 : 0) + (s.channels > 0 ? 1 : 0);
  if (ways == 0) {
    fail("rings", "no channels; give a table, elevations_deg or channels");
  } else if (ways > 1) {
    const char* second = has_list && !s.table.empty() ? "rings.elevations_deg" : "rings.channels";
    fail(second,
         fmt::format("has no effect beside rings.{}; remove one of them",
                     s.table.empty() ? "elevations_deg" : "table"));
  } else if (!s.azimuth_offsets_deg.empty() &&
             s.azimuth_offsets_deg.size() != s.elevations_deg.size()) {
    fail(
        "rings.azimuth_offsets_deg",
        fmt::format(
            "{} offsets for {} elevations", s.azimuth_offsets_deg.size(), s.elevations_deg.size()));
  } else if (s.elevations_deg.size() > kMostChannels) {
    fail("rings.elevations_deg", fmt::format("more than {} channels", kMostChannels));
  } else if (s.channels > 1 && s.elevation_min_deg >= s.elevation_max_deg) {
    fail("rings.elevation_min_deg",
         fmt::format("{} deg is not below elevation_max_deg {} deg",
                     s.elevation_min_deg,
                     s.elevation_max_deg));
  }
}

/// In each light a brighter target is seen from farther away; ranges of `near` ascend.
template <class Fail>
void check_detection(const DetectionSettings& s, const Fail& fail) {
  for (std::size_t i = 1; i < s.near.size(); ++i) {
    if (s.near[i].range > s.near[i - 1].range) continue;
    fail("detection.near",
         fmt::format("{} m after {} m: ranges ascend", s.near[i].range, s.near[i - 1].range));
  }
  for (std::size_t i = 0; i < s.rated.size(); ++i) {
    for (std::size_t k = 0; k < i; ++k) {
      const RatedRange& a = s.rated[k];
      const RatedRange& b = s.rated[i];
      if (a.sun_klx != b.sun_klx) continue;
      if ((a.reflectivity < b.reflectivity) == (a.range < b.range) &&
          a.reflectivity != b.reflectivity && a.range != b.range) {
        continue;
      }
      fail("detection.rated",
           fmt::format("{} m at {:.4g} % and {} m at {:.4g} % in {} klx: a brighter target is seen "
                       "from farther away",
                       a.range,
                       100.0 * a.reflectivity,
                       b.range,
                       100.0 * b.reflectivity,
                       b.sun_klx));
    }
  }
}

/// What a scan has at least; a table may have more channels than one.
double beams_a_scan(const LidarSettings& s) {
  if (s.pattern == ScanPattern::kRotor) {
    return s.rotor.shot_rate / s.rate * static_cast<double>(s.rotor.line_angles_deg.size());
  }
  if (s.pattern == ScanPattern::kPrisms) {
    return s.prisms.shot_rate / s.rate * static_cast<double>(s.prisms.line_heights.size());
  }
  if (s.pattern == ScanPattern::kCsv) return s.csv.points_per_second / s.rate;
  if (s.pattern == ScanPattern::kGrid) return static_cast<double>(s.grid.columns * s.grid.rows);
  const double listed =
      static_cast<double>(s.rings.elevations_deg.size()) + static_cast<double>(s.rings.channels);
  const double firings = s.rings.convention == RingConvention::kOuster
                             ? static_cast<double>(s.rings.columns)
                             : 1e6 / s.rings.cycle_us / s.rate;
  return firings * std::max(1.0, listed);
}

}  // namespace

void check(const LidarSettings& settings) {
  const auto fail = [&](const char* key, const std::string& what) {
    throw InputError(fmt::format("{}: {}: {}", settings.location(key), key, what));
  };
  if (settings.range_min >= settings.range_max) {
    fail("range_min",
         fmt::format("{} m is not below range_max {} m", settings.range_min, settings.range_max));
  }
  check_detection(settings.detection, fail);
  const GridSettings& grid = settings.grid;
  if (settings.pattern == ScanPattern::kRotor && settings.rotor.line_angles_deg.empty()) {
    fail("rotor.line_angles_deg", "no lines; at least one is needed");
  } else if (settings.pattern == ScanPattern::kPrisms && settings.prisms.line_heights.empty()) {
    fail("prisms.line_heights", "no lines; at least one is needed");
  } else if (settings.pattern == ScanPattern::kRings) {
    check_channels(settings.rings, fail);
  } else if (settings.pattern == ScanPattern::kCsv && settings.csv.file.empty()) {
    fail("csv.file", "missing; name the CSV of directions");
  } else if (settings.pattern == ScanPattern::kGrid) {
    if (grid.projection == GridProjection::kPinhole && (grid.fx <= 0.0 || grid.fy <= 0.0)) {
      fail("grid.projection", "pinhole needs fx and fy");
    }
    if (grid.projection == GridProjection::kPinhole && grid.stereo.baseline > 0.0) {
      // what a matcher measures has no echoes and no signal
      const char* const why = "has no effect beside grid.stereo; remove one of them";
      if (!settings.detection.rated.empty()) fail("detection.rated", why);
      if (settings.optics.divergence_horizontal_deg > 0.0) {
        fail("optics.divergence_horizontal_deg", why);
      }
      if (settings.optics.divergence_vertical_deg > 0.0)
        fail("optics.divergence_vertical_deg", why);
    }
  }
  if (const double beams = beams_a_scan(settings); beams > kMostBeams) {
    fail(settings.pattern == ScanPattern::kGrid ? "grid.columns" : "rate",
         fmt::format("{:.0f} beams per scan; {:.0f} at most", beams, kMostBeams));
  }
}

}  // namespace pointflight
