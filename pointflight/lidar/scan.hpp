#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "pointflight/core/time.hpp"
#include "pointflight/geometry/types.hpp"
#include "pointflight/lidar/beam_pattern.hpp"
#include "pointflight/map/body.hpp"

namespace pointflight {

/// One measured point.
struct ScanPoint {
  Vector3f position_sensor;  ///< In the sensor frame at the point's own firing time, m.
  float range = 0.0f;        ///< Measured, noise included, m.
  float intensity = 0.0f;    ///< Of the map, in its cloud's scale; 0 where it had none.
  Duration time_offset{0};   ///< After the scan's start.
  std::uint16_t ring = 0;    ///< As the maker's driver numbers it.
  std::uint32_t beam = 0;    ///< Index of the beam in the scan's pattern.
  Label label = kMapLabel;   ///< What it is of: the map, a vehicle, an obstacle.
  /// Its beam came through space that no survey saw: something may stand there in the real place.
  /// Told only where the scan's `marks.unknown`.
  bool is_unknown = false;
  /// Which of its beam's returns, in the order of `ReturnMode`. Told only where `marks.echoes`.
  std::uint8_t echo = 0;
};

/// What the points of a scan say beyond what all do.
struct ScanMarks {
  bool unknown = false;  ///< `ScanPoint::is_unknown`
  bool echoes = false;   ///< `ScanPoint::echo`: a beam may have several points.
};

/// What a LiDAR delivers for one scan: the returns in firing order.
struct Scan {
  std::uint64_t index = 0;        ///< Number of the scan since time zero; lost ones are counted.
  std::uint32_t vehicle = 0;      ///< Number of the vehicle in the scenario.
  std::uint32_t sensor = 0;       ///< Number of the LiDAR on it.
  SimTime start;                  ///< Inclusive.
  SimTime end;                    ///< Exclusive.
  std::size_t beams = 0;          ///< Fired, whether they returned or not.
  bool snapshot = false;          ///< All beams left from the sensor's pose at `middle`.
  SimTime middle;                 ///< Between first and last beam (a camera's: its start).
  ScanMarks marks;                ///< What points say besides.
  std::vector<ScanPoint> points;  ///< In firing order; beams without a return have none.

  /// When the sensor was where it saw a point from.
  [[nodiscard]] SimTime seen_at(const ScanPoint& point) const {
    return snapshot ? middle : start + point.time_offset;
  }
};

/// Writes x y z intensity range time (float32; time in seconds after the scan's start), ring
/// (uint16), label (uint16) and, where the scan marks them, unknown (uint8: 0, 1) and echo (uint8:
/// 0 to 2) as binary PCD. Throws InputError.
void write_scan_pcd(const std::string& path, const Scan& scan);

/// The points of such a file, taken with `beams`; their times and numbers are those of the beams,
/// to the nanosecond. The file has what `marks` says. Throws InputError, also where the points are
/// not those of the beams.
std::vector<ScanPoint> read_scan_points(const std::string& path,
                                        std::span<const Beam> beams,
                                        const ScanMarks& marks = {});

}  // namespace pointflight
