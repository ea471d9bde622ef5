#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "pointflight/core/time.hpp"
#include "pointflight/geometry/types.hpp"
#include "pointflight/io/pcd_writer.hpp"
#include "pointflight/lidar/beam_pattern.hpp"
#include "pointflight/lidar/lidar_settings.hpp"
#include "pointflight/map/body.hpp"
#include "pointflight/render/renderer.hpp"

namespace pointflight {

/// One measured point.
struct ScanPoint {
  Vector3f position_sensor;  ///< In the sensor frame at the point's own firing time, m.
  float range = 0.0f;        ///< Measured, noise included, m.
  float intensity = 0.0f;    ///< Of the map, in its cloud's scale; 0 if it had none.
  Duration time_offset{0};   ///< After the scan's start.
  std::uint16_t ring = 0;    ///< As the vendor's driver numbers it.
  std::uint32_t beam = 0;    ///< Index of the beam in the scan's pattern.
  Label label = kMapLabel;   ///< What it is of: the map, a vehicle, an obstacle.
  /// Its beam came through space that no survey saw: something may stand there in the real place.
  /// Told only if the scan's `marks.unknown`.
  bool is_unknown = false;
  /// Which of its beam's returns, in the order of `ReturnMode`. Told only if `marks.echoes`.
  std::uint8_t echo = 0;
};

/// What the simulator knows of a point and no sensor does. Of a false return (`kFalseReturn`) only
/// `range` and `deskewed` mean anything.
struct PointTruth {
  /// Without noise and rounding, m: the mean, by energy, of what came back in one pulse, along the
  /// beam as it really went (the point lies where the sensor believes it went).
  float range = 0.0f;
  /// Between the beam and the normal of what gave most of the light, rad, 0 to pi / 2.
  float incidence = 0.0f;
  /// From the nearest to the farthest thing in the pulse, m: a mixed pixel has some.
  float depth = 0.0f;
  /// The point in the sensor's frame at the scan's start, m: what exact deskewing makes of it.
  Vector3f deskewed = Vector3f::Zero();
  std::uint32_t surfel = kNoSurfel;  ///< What gave most of the light: `Hit::surfel`.
  std::uint16_t sub_ray = 0;         ///< Which sub-ray of the beam hit it.
  std::uint16_t sub_rays = 0;        ///< How many sub-rays are in the pulse; 0: a false return.
  bool is_assumed = false;           ///< `SurfelMap::is_assumed` of that surfel.
  SurfelLabel part_of;               ///< What that surfel is a part of, if its map says.
};

/// What the points of a scan say beyond what all do.
struct ScanMarks {
  bool unknown = false;  ///< `ScanPoint::is_unknown`
  bool echoes = false;   ///< `ScanPoint::echo`: a beam may have several points.
  bool truth = false;    ///< `Scan::truth`
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
  /// Of a depth camera if returns are modelled: the brightness of each beam's pixel, 0 if it
  /// hits nothing; else empty.
  std::vector<std::uint8_t> infrared;
  std::vector<PointTruth> truth;  ///< Of each point, where `marks.truth`; else empty.

  /// When the sensor was where it saw a point from.
  [[nodiscard]] SimTime seen_at(const ScanPoint& point) const {
    return snapshot ? middle : start + point.time_offset;
  }
};

/// What files have of each point, in this order and without padding: x y z intensity range time
/// (float32; time in seconds after the scan's start), ring (uint16), label (uint16) and, where the
/// scan marks them, unknown (uint8: 0, 1), echo (uint8: 0 to 2) and `PointTruth` (true_range
/// incidence depth deskewed_x deskewed_y deskewed_z, float32; surfel and thing, uint32; sub_ray and
/// sub_rays, uint16; assumed and class, uint8).
std::vector<PcdField> scan_fields(const ScanMarks& marks);

/// Bytes of a point with these fields.
std::size_t scan_row_size(const ScanMarks& marks);

/// The points as such rows; throws std::invalid_argument if `rows` has not their size.
void write_scan_rows(const Scan& scan, std::span<std::byte> rows);

/// The same as binary PCD. Throws InputError.
void write_scan_pcd(const std::string& path, const Scan& scan);

/// Fills in the points of such a file, and their truth, of a scan taken with `beams` whose `marks`
/// are set: the file has what they say. Times and numbers of the points are those of the beams, to
/// the nanosecond. Points may lie off their beams by what deskewing leaves (`left`). Throws
/// InputError, also if the points are not those of the beams.
void read_scan_points(const std::string& path,
                      std::span<const Beam> beams,
                      const DeskewingSettings& left,
                      Scan& scan);

}  // namespace pointflight
