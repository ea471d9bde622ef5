// What a scan becomes besides a cloud in the sensor's frame.
#pragma once

#include <vector>

#include "pointflight/geometry/motion.hpp"
#include "pointflight/lidar/lidar_settings.hpp"
#include "pointflight/lidar/scan.hpp"
#include "pointflight/map/surfel_map.hpp"
#include "pointflight/ros/common/messages.hpp"

namespace pointflight {

/// Points of a scan in the axes of the world, from `origin` (world, m) on, each by the sensor's
/// pose at its own time.
std::vector<Vector3f> world_points(const Scan& scan,
                                   const PoseTrack& T_world_sensor,
                                   const Vector3d& origin);

/// Depth picture of a scan, encoding 32FC1. Pinhole cameras: depth along the optical axis, m, 0
/// if nothing returned (REP 118 has NaN, planners expect 0). Other sensors: a picture over
/// azimuth (columns, left first) and elevation (rows, highest first) at `image_resolution_deg`,
/// range as a share of `range_max`, 1 if nothing returned (MARSIM's depth_img).
msg::Image depth_image_of(const Scan& scan, const LidarSettings& lidar);

/// True for sensors whose picture has a camera matrix.
bool is_camera(const LidarSettings& lidar);

/// `Scan::infrared` of a depth camera as mono8.
msg::Image infrared_image_of(const Scan& scan, const LidarSettings& lidar);

/// Camera matrix of a pinhole camera; a picture of zero size for other sensors.
msg::CameraInfo camera_info_of(const LidarSettings& lidar);

/// The map's surfels as points, one for each cell of `resolution` (m) at least; coarser if there
/// would be more than `points_max`.
struct MapCloud {
  std::vector<Vector3f> points;  ///< In the axes of the world, from an origin on, m.
  /// Of each point, in the cloud's scale; 0 if the map has none.
  std::vector<float> intensities;
  double resolution = 0.0;  ///< That was taken, m.
};
/// As many points as the map has, in the order of its file, if `resolution` is at most its own.
/// `origin` (world, m) becomes their zero.
MapCloud map_cloud(const SurfelMap& map,
                   double resolution,
                   std::size_t points_max,
                   const Vector3d& origin);

/// Points on the surface of a shape, about `spacing` apart, in the frame of the pose.
void append_surface(const BodyShape& shape,
                    const Pose& T_frame_body,
                    double spacing,
                    std::vector<Vector3f>& points);

/// Centres of the map's surfels that a hull touches, in the axes of the world, from `origin`
/// (world, m) on.
std::vector<Vector3f> touched_points(const SurfelMap& map,
                                     const Solid& hull,
                                     const Pose& T_world_hull,
                                     const Vector3d& origin);

}  // namespace pointflight
