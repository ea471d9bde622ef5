#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "pointflight/flight_log/log_comparison.hpp"
#include "pointflight/lidar/lidar.hpp"
#include "pointflight/map/surfel_map.hpp"
#include "pointflight/picture/canvas.hpp"
#include "pointflight/picture/run_picture.hpp"
#include "pointflight/vehicle/step_response.hpp"

/// Each writes a PNG; throws InputError if it cannot.
namespace pointflight::picture {

/// A way in the picture of a map.
struct MapWay {
  std::vector<Vector3d> points_world;  ///< Corners, m; a ring at the first, a disc at the last.
  std::string label;                   ///< At its end.
  Color color;                         ///< Of the line.
};

/// A top and a side view of a map, coloured by height. A ceiling over most of it is left out of the
/// top view, which `ways` are drawn into.
void draw_map(const SurfelMap& map,
              const std::string& title,
              const std::string& path,
              std::span<const MapWay> ways = {});

/// What a picture of a world shows.
struct WorldPicture {
  std::shared_ptr<const SurfelMap> map;  ///< Never null.
  std::string title;                     ///< Above both views.
  Vector3d from;                         ///< The eye inside, m.
  Vector3d to;                           ///< What it looks at, m.
  /// By the numbers of the map's classes; surfels of others are coloured by height.
  std::vector<Color> class_colors = {};
};
/// Each from outside, without a ceiling over most of it, and from inside, in daylight.
void draw_worlds(std::span<const WorldPicture> worlds, const std::string& path);

/// Where a scan was taken.
struct ScanSetting {
  const SurfelMap& map;  ///< The map.
  Pose T_world_sensor;   ///< For all of the scan.
};

/// Range over azimuth and elevation, one mark for each beam; beams without a return stay dark. And
/// the points in the map, in perspective.
void draw_scan(const std::vector<Beam>& beams,
               const Scan& scan,
               const LidarSettings& lidar,
               const ScanSetting& place,
               const std::string& path);

/// Top and side view of map, flown paths, obstacles, waypoints and what the LiDARs saw. The map
/// above the flight is left out of the top view.
void draw_overview(const SurfelMap& map, const RunPicture& run, const std::string& path);

/// The colour of a vehicle; neighbours are told apart without red and green too.
Color vehicle_color(std::size_t number);

/// A vehicle's step responses beside what its loops were designed for.
void draw_step_responses(const VehicleSettings& vehicle,
                         const std::vector<StepResponse>& responses,
                         const std::string& path);

/// What the IMU measured beside what `vehicle` does by the logged outputs, over the twelve seconds
/// that turn most; `window`: as it was compared with.
void draw_log_comparison(const FlightLog& log,
                         const VehicleSettings& vehicle,
                         const LogComparison& comparison,
                         double window,
                         const std::string& path);

/// A sensor's pattern after 0.1 s and after 1 s, and how its coverage grows. Throws InputError if
/// it cannot be written.
void draw_lidar(const LidarSettings& lidar, const std::string& path);

/// The page of `draw_overview`, for tests of what is written on it.
std::unique_ptr<Canvas> overview_page(const SurfelMap& map, const RunPicture& run);
/// The page of `draw_map`.
std::unique_ptr<Canvas> map_page(const SurfelMap& map,
                                 const std::string& title,
                                 std::span<const MapWay> ways = {});
/// The page of `draw_lidar`.
std::unique_ptr<Canvas> lidar_page(const LidarSettings& lidar);

}  // namespace pointflight::picture
