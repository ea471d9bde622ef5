// What stands in a sensor's way because it is carried: a drone's legs, a person's shoulders.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "pointflight/core/time.hpp"
#include "pointflight/geometry/types.hpp"
#include "pointflight/lidar/lidar_settings.hpp"

namespace pointflight {

/// Directions of a sensor within which beams do not leave its carrier.
struct BlockedSector {
  double azimuth_from = 0.0;    ///< deg, from the sensor's x towards its y, -180 to 180.
  double azimuth_to = 0.0;      ///< deg; below `azimuth_from`: across the back.
  double elevation_from = 0.0;  ///< deg above the sensor's x-y plane, -90 to 90.
  double elevation_to = 0.0;    ///< deg
  double share = 1.0;           ///< Of the time, 0 to 1.
};

/// Which directions of a sensor are blocked, and how much of the time.
///
/// What is there part of the time comes and goes as one: where a person's shoulder reaches half of
/// the time, it is also where it reaches a fifth of it. At any time there is a level between 0 and
/// 1, and what is blocked for a greater share of the time than it is blocked then.
class Blockage {
 public:
  /// Nothing is.
  Blockage() = default;
  /// Where sectors overlap the greatest share counts.
  explicit Blockage(const std::vector<BlockedSector>& sectors);

  /// True if nothing is.
  [[nodiscard]] bool empty() const { return sectors_ == 0; }
  /// Share of the time in which a direction (unit vector, sensor frame) is blocked, 0 to 1.
  [[nodiscard]] double share(const Vector3f& direction_sensor) const;

 private:
  static constexpr std::size_t kRows = 180;               ///< Bands of elevation of one degree.
  std::array<std::vector<BlockedSector>, kRows> of_row_;  ///< Those that touch each band.
  std::size_t sectors_ = 0;
};

/// The level of a sensor's blockage at a time: uniform in [0, 1) over a run, and the same within a
/// second or so (assumed: what carries it moves as people walk). `sensor`: the entity of its random
/// streams.
double blockage_level(std::uint64_t seed, std::uint32_t sensor, SimTime time);

/// Reads sectors from a CSV with columns azimuth_from_deg, azimuth_to_deg, elevation_from_deg,
/// elevation_to_deg and, if it is not all of the time, share. Throws InputError with file and line.
///@{
std::vector<BlockedSector> read_blocked_sectors(const std::string& path);
std::vector<BlockedSector> parse_blocked_sectors(std::string_view text, const std::string& path);
///@}

/// The same from the file that a sensor's settings name, from whose folder its path is taken.
std::vector<BlockedSector> read_blocked_sectors(const LidarSettings& settings);

/// Such a CSV.
std::string blocked_sectors_csv(const std::vector<BlockedSector>& sectors);

}  // namespace pointflight
