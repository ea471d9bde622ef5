#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "pointflight/core/parallel.hpp"
#include "pointflight/core/time.hpp"
#include "pointflight/geometry/types.hpp"

namespace pointflight {

struct LidarSettings;

/// One laser shot, in the sensor frame (x forward, y left, z up).
struct Beam {
  Vector3f origin_sensor = Vector3f::Zero();      ///< Where it leaves: not zero for Ouster, HDL-64.
  Vector3f direction_sensor = Vector3f::UnitX();  ///< Unit vector.
  Duration time_offset{0};                        ///< Firing time after the start of the scan.
  /// As the vendor's driver numbers it: Velodyne's channels from below, Ouster's rows from above,
  /// Livox' lines.
  std::uint16_t ring = 0;
};

/// Where and when a LiDAR fires during one scan.
///
/// To add a scan principle: a file in lidar/patterns/ with a class derived from this and its keys
/// in LidarSettings, one line in the table in beam_pattern.cpp, a test of its data-sheet figures
/// (field of view, points per second, rings).
class BeamPattern {
 public:
  virtual ~BeamPattern() = default;

  /// Beams of one scan, in firing order. Scan k covers [k, k + 1) / rate seconds of the sensor's
  /// own time. The same for an index always; repeating sensors return the same for all indices.
  [[nodiscard]] virtual std::vector<Beam> beams(std::uint64_t scan_index,
                                                const Executor& executor) const = 0;

  /// True if all scans have the same beams: what is worked out for one is kept.
  [[nodiscard]] virtual bool repeats() const { return false; }
};

/// Makes the pattern that the settings name. Throws InputError.
std::unique_ptr<BeamPattern> make_pattern(const LidarSettings& settings);

/// The shots n of a train at `phase + n / rate` that fall into scan k of a sensor with `scan_rate`.
struct ShotTrain {
  Schedule shots;  ///< When it fires.
  Schedule scans;  ///< When scans start: at k / scan_rate.

  /// The first shot is at `phase` after time zero. Rates must be at least 0.001 Hz.
  ShotTrain(double shot_rate_hz, Duration phase, double scan_rate_hz)
      : shots(shot_rate_hz, phase), scans(scan_rate_hz) {}

  /// The shots of one scan.
  struct Range {
    std::int64_t begin = 0;  ///< First shot of the scan.
    std::int64_t end = 0;    ///< One past its last shot.
    SimTime scan_start;      ///< k / scan_rate, rounded to a nanosecond.
  };
  /// Every shot belongs to exactly one scan, also if the rates do not divide.
  [[nodiscard]] Range in_scan(std::uint64_t scan_index) const;

 private:
  /// The first shot at or after an instant.
  [[nodiscard]] std::int64_t first_at_or_after(SimTime time) const;
};

/// Unit vector for an azimuth (from x towards y) and elevation, radians.
Vector3d direction_of(double azimuth, double elevation);

/// Light through a face between two media (Snell in vector form): unit `direction`, unit `normal`
/// with direction . normal > 0, `ratio` = n_from / n_to. Zero vector on total reflection.
Vector3d refract(const Vector3d& direction, const Vector3d& normal, double ratio);

}  // namespace pointflight
