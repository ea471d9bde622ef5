#include "pointflight/ros/common/scan_messages.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <unordered_set>

#include "pointflight/core/constants.hpp"
#include "pointflight/core/math.hpp"
#include "pointflight/map/internal/near_surfels.hpp"

namespace pointflight {
namespace {

/// Columns and rows of the angular picture of a sensor that is no camera, and where it begins.
struct AngularPicture {
  int columns = 0, rows = 0;
  double step = 0.0;             ///< rad
  double left = 0.0, top = 0.0;  ///< Azimuth and elevation of the first pixel's edge, rad.
};

AngularPicture angular_picture(const LidarSettings& lidar) {
  AngularPicture picture;
  picture.step = std::max(0.05, lidar.image_resolution_deg) * kDegree;
  double wide = 2.0 * kPi;
  double high = 0.5 * kPi;
  double low = -0.5 * kPi;
  if (lidar.pattern == ScanPattern::kGrid) {
    wide = lidar.grid.fov_horizontal_deg * kDegree;
    high = 0.5 * lidar.grid.fov_vertical_deg * kDegree;
    low = -high;
  }
  picture.left = 0.5 * wide;
  picture.top = high;
  picture.columns = static_cast<int>(std::ceil(wide / picture.step - 1e-6));
  picture.rows = static_cast<int>(std::ceil((high - low) / picture.step - 1e-6));
  return picture;
}

msg::Image blank_image(int columns, int rows, float value) {
  msg::Image image;
  image.width = static_cast<std::uint32_t>(columns);
  image.height = static_cast<std::uint32_t>(rows);
  image.encoding = "32FC1";
  image.step = 4 * image.width;
  image.data.resize(std::size_t{4} * image.width * image.height);
  for (std::size_t i = 0; i < image.data.size(); i += 4) {
    std::memcpy(image.data.data() + i, &value, 4);
  }
  return image;
}

/// Keeps the nearer of two values in a pixel; `empty` is what blank pixels hold.
void put_nearest(msg::Image& image, std::size_t pixel, float value, float empty) {
  float there = 0.0f;
  std::uint8_t* at = image.data.data() + 4 * pixel;
  std::memcpy(&there, at, 4);
  if (there != empty && there <= value) return;
  std::memcpy(at, &value, 4);
}

}  // namespace

std::vector<Vector3f> world_points(const Scan& scan,
                                   const PoseTrack& T_world_sensor,
                                   const Vector3d& origin) {
  std::vector<Vector3f> points;
  points.reserve(scan.points.size());
  // several points leave at one time: their pose is worked out once
  SimTime known = SimTime::min();
  Pose pose;
  for (const ScanPoint& point : scan.points) {
    if (scan.seen_at(point) != known) {
      known = scan.seen_at(point);
      pose = T_world_sensor.at(known);
      pose.translation -= origin;
    }
    points.emplace_back((pose * point.position_sensor.cast<double>()).cast<float>());
  }
  return points;
}

bool is_camera(const LidarSettings& lidar) {
  return lidar.measures_depth();
}

msg::Image depth_image_of(const Scan& scan, const LidarSettings& lidar) {
  if (is_camera(lidar)) {
    // beams are its pixels, row by row; the axis looks along x of the sensor
    const auto columns = static_cast<int>(lidar.grid.columns);
    msg::Image image = blank_image(columns, static_cast<int>(lidar.grid.rows), 0.0f);
    const std::size_t pixels = std::size_t{image.width} * image.height;
    for (const ScanPoint& point : scan.points) {
      if (point.beam < pixels) put_nearest(image, point.beam, point.position_sensor.x(), 0.0f);
    }
    return image;
  }
  const AngularPicture picture = angular_picture(lidar);
  msg::Image image = blank_image(picture.columns, picture.rows, 1.0f);
  for (const ScanPoint& point : scan.points) {
    const Vector3d d = point.position_sensor.cast<double>();
    const double azimuth = math::atan2(d.y(), d.x());
    const double elevation = math::atan2(d.z(), std::hypot(d.x(), d.y()));
    const int column = static_cast<int>(std::floor((picture.left - azimuth) / picture.step));
    const int row = static_cast<int>(std::floor((picture.top - elevation) / picture.step));
    if (column < 0 || row < 0 || column >= picture.columns || row >= picture.rows) continue;
    const auto share = static_cast<float>(static_cast<double>(point.range) / lidar.range_max);
    put_nearest(image,
                static_cast<std::size_t>(row) * image.width + static_cast<std::size_t>(column),
                std::min(share, 1.0f),
                1.0f);
  }
  return image;
}

msg::Image infrared_image_of(const Scan& scan, const LidarSettings& lidar) {
  msg::Image image;
  image.width = static_cast<std::uint32_t>(lidar.grid.columns);
  image.height = static_cast<std::uint32_t>(lidar.grid.rows);
  image.encoding = "mono8";
  image.step = image.width;
  image.data = scan.infrared;
  return image;
}

msg::CameraInfo camera_info_of(const LidarSettings& lidar) {
  msg::CameraInfo info;
  if (!is_camera(lidar)) return info;
  const GridSettings& g = lidar.grid;
  info.width = static_cast<std::uint32_t>(g.columns);
  info.height = static_cast<std::uint32_t>(g.rows);
  info.distortion_model = "plumb_bob";
  info.d.assign(5, 0.0);
  info.k = {g.fx, 0.0, g.cx, 0.0, g.fy, g.cy, 0.0, 0.0, 1.0};
  info.r = {1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0};
  info.p = {g.fx, 0.0, g.cx, 0.0, 0.0, g.fy, g.cy, 0.0, 0.0, 0.0, 1.0, 0.0};
  return info;
}

MapCloud map_cloud(const SurfelMap& map,
                   double resolution,
                   std::size_t points_max,
                   const Vector3d& origin) {
  MapCloud cloud;
  cloud.resolution = std::max(resolution, map.resolution());
  const Vector3d low = map.bounds_world().empty() ? Vector3d(0, 0, 0) : map.bounds_world().min;
  for (;;) {
    cloud.points.clear();
    cloud.intensities.clear();
    std::unordered_set<std::uint64_t> taken;
    const bool all = cloud.resolution <= map.resolution();
    map.for_each_surfel([&](const Vector3d& center, const Vector3d&, double, std::uint32_t word) {
      if (cloud.points.size() > points_max) return;
      const Vector3d cell = ((center - low) / cloud.resolution).array().floor();
      // stored centres may lie a little outside of the bounds
      const auto index = [&](int axis) {
        return static_cast<std::uint64_t>(static_cast<std::int64_t>(cell[axis]) + 1);
      };
      const std::uint64_t key = index(0) | index(1) << 21 | index(2) << 42;
      if (!all && !taken.insert(key).second) return;
      cloud.points.emplace_back((center - origin).cast<float>());
      cloud.intensities.push_back(map.intensity(word));
    });
    if (cloud.points.size() <= points_max) return cloud;
    cloud.resolution *= 1.25;
  }
}

void append_surface(const BodyShape& shape,
                    const Pose& T_frame_body,
                    double spacing,
                    std::vector<Vector3f>& points) {
  const auto* solid = std::get_if<Solid>(&shape);
  if (solid == nullptr) {
    const auto& map = std::get<std::shared_ptr<const SurfelMap>>(shape);
    map->for_each_surfel([&](const Vector3d& p, const Vector3d&, double, std::uint32_t) {
      points.emplace_back((T_frame_body * p).cast<float>());
    });
    return;
  }
  for (const Vector3d& p : surface_points(*solid, spacing)) {
    points.emplace_back((T_frame_body * p).cast<float>());
  }
}

std::vector<Vector3f> touched_points(const SurfelMap& map,
                                     const Solid& hull,
                                     const Pose& T_world_hull,
                                     const Vector3d& origin) {
  const Vector3d reach = Vector3d::Constant(bounding_radius(hull));
  Aabb around;
  around.add(T_world_hull.translation - reach);
  around.add(T_world_hull.translation + reach);
  std::vector<Vector3f> points;
  visit_near(map, around, 0.0, [&](const SurfelBox& box) {
    const Separation s = separation(hull, T_world_hull, Solid{Box{box.half}}, box.T_world_box);
    if (s.distance <= 0.0) {
      points.emplace_back((box.T_world_box.translation - origin).cast<float>());
    }
    return 0.0;
  });
  return points;
}

}  // namespace pointflight
